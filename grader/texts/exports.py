"""The sentences of exports: why a student has no grade in a file, and notes on what to look at.

Each code has its text, or several, the most precise first: the first is said whose parameters are all known.
"""

from grader.language import N_

EXPORTS: dict[str, str | tuple[str, ...]] = {
    # Students without a final grade: statuses of reports.
    "needs_review": (N_("position %(position)s: needs review"), N_("needs review")),
    "unreadable": (N_("position %(position)s: unreadable"), N_("unreadable")),
    "missing": (N_("position %(position)s: nothing handed in"), N_("nothing handed in")),
    "no_score": (N_("position %(position)s: has no score"), N_("has no score")),
    "position_absent": N_("has no position %(position)s"),
    # Students without a place in the platform's file.
    "row_absent": (
        N_("nobody in the platform's file has %(known)s"),
        N_("nothing is known by which to look for the student in the platform's file"),
    ),
    "row_several": N_("rows %(rows)s of the platform's file all have the %(column)s"),
    "row_contrary": N_("row %(row)s of the platform's file has the %(column)s, but another %(other)s"),
    "row_shared": N_("row %(row)s of the platform's file (%(who)s) fits several students: %(students)s"),
    "grade_locked": N_("Moodle says that this grade cannot be changed"),
    "grade_excused": N_("%(platform)s says '%(text)s': excused, or not given this assignment"),
    "id_absent": N_("the table of ids (--ids) has no id: the user's own in %(platform)s"),
    "participant_absent": N_("the table of ids (--ids) has no participant"),
    "submission_absent": N_(
        "the submission is not known: ask the platform for %(asked)s and give the answer (--submissions)"
    ),
    "outcomes_absent": N_("no outcomes of all kinds in the answer: ask for %(asked)s"),
    "rubric_first": N_(
        "points follow once the rubric is there: give the platform's answer for it (--criteria)"
    ),
    "platform_refuses": (
        N_("the platform answers %(status)s"),
        N_("the platform does not answer as it should"),
    ),
    # Notes on any file.
    "nobody_ready": N_("nobody has a grade yet: there is none to upload"),
    "by_name_alone": N_("found by name alone, check that these are the right students: %(students)s"),
    "grades_changed": N_("grades changed that %(platform)s has already: %(count)s"),
    "comments_changed": N_("comments replaced that %(platform)s has already: %(count)s"),
    "withheld_stay": N_("withheld, and a grade is there already, which stays: %(students)s"),
    "look_alike": N_("these sheets look alike, look at them before their grades are out: %(students)s"),
    "archive_size": N_("the archive has %(size)s: the site's upload limit must allow it"),
    "maximum_there": N_("the assignment must be out of %(most)s there"),
    "points_become": N_("%(platform)s sets the assignment's points to %(most)s"),
    # On Moodle's worksheet, gradebook, archive and guide.
    "updates": N_(
        "the number of updated grades that Moodle reports must be %(count)s (more only where it stores more"
        " decimals than it shows); otherwise this is the worksheet of another assignment or course, or an old"
        " one"
    ),
    "zeros": N_("newer versions of Moodle skip a grade of 0, enter it there: %(names)s"),
    "dates_of_file": N_(
        "Moodle reads no dates in this language: they are written as the file's time, %(moment)s; if the"
        " file was copied or sent since the download, grades given in between are overwritten: download it in"
        " English, Romanian or Russian"
    ),
    "changed_if_fresh": N_(
        "grades changed that Moodle has already: %(count)s; it skips them unless the box for updating"
        " records is ticked at the upload, or the worksheet was downloaded afresh"
    ),
    "made_before": N_(
        "this file was made before: if it was uploaded then, Moodle skips what it has already, unless the"
        " worksheet was downloaded afresh or the box for updating records is ticked at the upload"
    ),
    "no_comments": N_("the worksheet has no column for feedback comments: only grades are filled in"),
    "anonymous": N_(
        "participants are anonymous: students and the gradebook are shown no grades and no feedback until"
        " you choose 'Reveal student identities' in Moodle"
    ),
    "workflow": N_(
        "the assignment has a marking workflow: students and the gradebook are shown grades once their state"
        " is 'Released'"
    ),
    "worksheet_better": N_(
        "where there is an assignment, its grading worksheet is the better way (--worksheet)"
    ),
    "item_first": N_(
        "make the grade item in Moodle first, out of %(most)s, and map grade and feedback to it: a new item"
        " is out of 100 and takes no feedback"
    ),
    "no_row": N_("withheld students have no row: the import leaves their grades unchanged"),
    "above_hundred": N_("some grades are above 100: Moodle takes them only where the site allows it"),
    "grades_first": N_(
        "upload grades before feedback files: the files make Moodle take a worksheet for outdated"
    ),
    "not_for_groups": N_("not for groups: there Moodle takes a participant's number for a group's"),
    "guide_lost": N_("saving this guide deletes the one there with %(count)s fillings of %(grades)s grades"),
    "comments_go_too": N_(
        "each call also replaces the student's feedback comment: without one Moodle stores half of it"
    ),
    # On other platforms' files.
    "tabs": N_("the cells are separated by tabs: let the name end with .xls, or choose Tab at the upload"),
    "new_assignment": N_(
        "Canvas takes '%(text)s' for a new assignment: give --item as it stands in an exported gradebook,"
        " 'title (number)', or that file itself (--gradebook)"
    ),
    "org_defined_id": N_(
        "OrgDefinedId is the student_id: where it is another number, give Brightspace's export (--gradebook)"
    ),
    "item_cut": N_(
        "an item '%(text)s' that is there must be out of %(most)s: Brightspace cuts what is above"
    ),
    "two_decimals": N_(
        "grades have two decimals there; programs cannot write points by criterion: --to csv has them"
    ),
    "quarters": N_(
        "a level is the nearest quarter; the exact points are the grade's, and stand in each feedback"
    ),
    "rubric_of_its_own": N_(
        "a published assignment has a rubric of its own: then give the answer to %(asked)s (--criteria)"
    ),
    "whole_points": N_(
        "Open edX takes whole points: all are multiplied by %(times)s, %(total)s become %(become)s; the"
        " grade is their share and stays the same"
    ),
    "options_of_class": N_(
        "the options are the points that this class has: after a regrade with others put the rubric in again"
    ),
    "rounded": N_("rounded to hundredths: the points of %(students)s"),
    "users_by_id": N_("userId is the student_id: where the platform knows users otherwise, give --ids"),
    "pending": N_("withheld and sent as PendingManual, so that the platform shows no grade: %(count)s"),
}
