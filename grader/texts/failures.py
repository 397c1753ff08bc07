"""The sentences of errors of calls and platforms' files, by their causes or codes: see `failure`."""

from grader.language import N_

FAILURES: dict[str, str] = {
    # Results and folders
    "results_missing": N_("%(file)s: there is no such file; run planmark grade first"),
    "unreadable": N_("%(file)s: cannot be read (%(error)s)"),
    "no_results": N_("%(file)s: is not a planmark results file; grade again\n%(faults)s"),
    "results_no_json": N_("%(file)s: is not JSON (%(error)s); grade again"),
    "results_newer": N_(
        "%(file)s: a later version of planmark wrote this (schema_version %(version)s, known is"
        " %(known)s); update planmark, or grade again with this one"
    ),
    "results_contradict": N_("results.json contradicts itself; grade again\n%(faults)s"),
    "points_impossible": N_("%(student)s: points that there are not; grade again\n%(faults)s"),
    "points_sum": N_(
        "%(student)s: the criteria give %(total)s points together, the score is %(score)s; grade again, or"
        " export grades without criteria"
    ),
    "folder_missing": N_("%(folder)s: there is no such folder"),
    "nothing_to_grade": N_("%(folder)s: there is nothing to grade in this folder"),
    "nothing_came": N_("%(folder)s: nothing came that could be graded"),
    "run_unknown": N_(
        "%(folder)s: nothing says what was graded here; run planmark grade first, then name its --out"
    ),
    "submissions_moved": N_(
        "%(folder)s: the submissions are not in %(was)s any more; grade them again where they are now"
    ),
    "results_in_use": N_(
        "%(folder)s: another run writes its results here (process %(pid)s on %(host)s, since %(began)s,"
        " over %(sheets)s); wait until it ends, or choose another --out"
    ),
    "in_use_unsaid": N_(
        "%(folder)s: another run writes its results here (it does not say which); wait until it ends, or"
        " choose another --out"
    ),
    "of_another_assignment": N_(
        "%(folder)s: holds the results of the assignment %(there)s, not of %(given)s; choose another"
        " --out, or remove this folder first"
    ),
    "of_another_folder": N_(
        "%(folder)s: holds the results of %(there)s; choose another --out, or remove this folder first"
    ),
    "decisions_missing": N_("%(file)s: there is no such file of decisions"),
    "roster_needed": N_("answer sheets need --roster: a sheet carries its student's code"),
    # Calls of an export
    "unknown_target": N_("'%(to)s' is no export target: known are %(names)s"),
    "unknown_thing": N_("%(to)s is given no '%(what)s': known are %(names)s"),
    "thing_elsewhere": N_("%(to)s is given no '%(what)s': known are %(names)s (or --to %(other)s)"),
    "option_unused": N_("%(option)s has no meaning for %(what)s: leave it out"),
    "form_unused": N_("a file to fill in has no meaning for %(what)s: leave it out"),
    "unused_beside": N_("%(option)s has no meaning beside %(other)s: leave it out"),
    "maximum_stated": N_("--maximum has no meaning beside %(other)s: it states its own"),
    "worksheet_of_moodle": N_("--worksheet is Moodle's: give it with --to moodle alone"),
    "read_for_export": N_("%(file)s: is read for this export; name another file (--file)"),
    "number": N_("%(option)s: '%(text)s' is no number, as %(to)s has it in addresses"),
    "maximum": N_("a grade's maximum is a positive number, not %(maximum)s"),
    "maximum_differs": N_(
        "the grade's maximum there is %(there)s, the rubric's is %(here)s: set the same maximum there, or"
        " ask for rescaling (--rescale)"
    ),
    "maxima_differ": N_(
        "students' maxima differ: choose one position, combine them by mean, or convert all to one maximum"
        " (--maximum and --rescale, where the platform is given grades)\n%(faults)s"
    ),
    "maximum_unknown": N_(
        "%(file)s: states no maximum grade; look it up in %(platform)s and give it (--maximum)"
    ),
    "combine": N_("'%(combine)s' is no way to combine positions: choose sum or mean"),
    "position_or_combine": N_("either one position or a way to combine them, not both"),
    "several_positions": N_(
        "%(student)s has %(count)s positions and the file has room for one grade: choose a position, or"
        " combine them by sum or mean"
    ),
    "nothing_to_export": N_("the results hold no report that could be exported"),
    "no_criteria": N_("no report has criteria: nothing was handed in that was read"),
    "no_numbers": N_("no student has a number in Moodle\n%(faults)s"),
    "archive_name": N_("%(file)s: %(to)s takes an archive; let its name end with .zip"),
    "several_files": N_("%(file)s: %(count)s files; name a .zip, or a folder"),
    "visibility": N_("'%(text)s' is no visibility: choose %(names)s"),
    "identity": N_("users are found by %(names)s, not by '%(text)s'"),
    "criteria_differ": N_(
        "one rubric cannot hold all; grade all with one rubric, or choose a position\n%(faults)s"
    ),
    "named_twice": N_(
        "the platform would not take this as it is meant; nothing was written\n  %(what)s %(name)s stands"
        " twice"
    ),
    # Calls of a check
    "measured_needed": N_(
        "--measured FILE is needed: your measurements; --template FILE writes a file to fill in"
    ),
    "page_file": N_("--page %(file)s: the name must end in .html; print the page for paper"),
    "page_students": N_("--page is one student's: %(file)s holds %(count)s"),
    "template_file": N_("--template %(file)s: the name must end in .csv"),
    "template_exists": N_(
        "--template %(file)s: there is such a file already, perhaps filled in: choose another name"
    ),
    "unknown_level": N_("--level %(level)s: known are %(names)s"),
    "unknown_assignment": N_(
        "there is no assignment '%(name)s'; built in are %(names)s; or give the path of a .toml file"
    ),
    "number_needed": N_("--%(what)s is needed: this assignment has %(what)s from %(first)s to %(last)s"),
    "number_range": N_("%(what)s = %(value)s: this assignment has %(what)s from %(first)s to %(last)s"),
    "number_disagrees": N_("--%(what)s %(called)s, but %(file)s says %(what)s %(filed)s: which is right?"),
    # Files of a platform
    "not_utf8": N_("%(file)s: is not UTF-8 text (byte %(byte)s); download it again and do not resave it"),
    "quote_broken": N_("%(file)s, row %(row)s: text follows a closing quote"),
    "quote_open": N_("%(file)s, row %(row)s: a quote is opened and never closed"),
    "worksheet": N_(
        "%(file)s: Moodle would not take this worksheet; download it again and do not resave it\n%(faults)s"
    ),
    "worksheet_empty": N_("%(file)s: the worksheet is empty; download it from Moodle again"),
    "worksheet_column": N_("%(file)s, row 1: there are %(count)s columns '%(name)s'"),
    "worksheet_needed": N_(
        "Moodle's numbers of participants are needed: give the downloaded grading worksheet (--worksheet),"
        " or a table with the columns student_id,participant (--ids)"
    ),
    "gradebook_file": N_(
        "%(file)s: is no gradebook as %(platform)s exports it; export it again and do not resave"
        " it\n%(faults)s"
    ),
    "gradebook_needed": N_(
        "%(platform)s takes grades only in its own file: download it there and give it (--gradebook)"
    ),
    "archive_needed": N_(
        "ILIAS's archive is needed: Multi-Feedback, Download (--gradebook multi_feedback_....zip)"
    ),
    "no_archive": N_("%(file)s: is no archive of ILIAS (%(error)s)"),
    "archive_folders": N_(
        "%(file)s: has no folders multi_feedback.../Last_First_login_number; download it again"
    ),
    "gradebook": N_("Canvas would misread this; nothing was written\n%(faults)s"),
    "import_aborted": N_("Moodle would abort this import; nothing was written\n%(faults)s"),
    "item_formula": N_("'%(item)s' is no name for a grade item: a spreadsheet would run it"),
    "item_sign": N_("'%(item)s': a grade item's name in Brightspace cannot have '%(sign)s'"),
    "item": N_("%(file)s: %(count)s assignments fit '%(item)s': name one with --item out of %(choices)s"),
    "item_open": N_("%(file)s: which assignment? Name it with --item: %(choices)s"),
    "feedback_missing": N_("not all feedback is there; grade again, nothing was written\n%(faults)s"),
    "criteria": N_("%(file)s: these are not the rubric's criteria\n%(faults)s"),
    "answer_without_criteria": N_(
        "%(file)s: no criteria are in this answer; ask the platform for its rubric (Moodle:"
        " core_grading_get_definitions), or write a CSV table with the columns criterion,id"
    ),
    "no_json_answer": N_("%(file)s: is not JSON (%(error)s)"),
    "no_answer_to": N_("%(file)s: is not Moodle's answer to %(asked)s"),
}
