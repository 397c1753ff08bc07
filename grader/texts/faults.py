"""Faults of files that people write: the clauses behind the place of a fault.

Each code has its texts, the most precise first: the first one is said whose parameters are all known.
"""

from grader.language import N_
from grader.texts.authored import AUTHORED

FAULTS: dict[str, tuple[str, ...]] = {
    **AUTHORED,
    # Of a file or line as a whole.
    "not_there": (
        N_("there is no such file; check its path, or write a CSV table with the columns %(names)s"),
    ),
    "no_file": (N_("cannot be read: it is a folder or a pipe, not a file"),),
    "not_readable": (N_("cannot be read: %(error)s"),),
    "too_large": (N_("is larger than %(most)s MB, and no such table is; check which file it is"),),
    "not_utf8": (N_("is not UTF-8 text; save it as CSV in UTF-8"),),
    "too_many_lines": (N_("has more than %(most)s lines, too many for a class's table"),),
    "no_csv": (N_("from here on it is no CSV; check its quotes: one is not closed, or text follows one"),),
    "table_empty": (N_("the file is empty; its first line must name the columns"),),
    "column_missing": (N_("column %(name)s is missing; the columns are %(names)s"),),
    "column_twice": (N_("column %(name)s is there %(count)s times; leave one"),),
    "column_unknown": (
        N_("column '%(name)s' is not known; did you mean %(near)s?"),
        N_("column '%(name)s' is not known; remove it"),
    ),
    "no_measurements": (N_("no known column of measurements; known are %(names)s, ..."),),
    "fields_surplus": (
        N_(
            "has %(fields)s fields, the first line names %(columns)s columns; quote a field that holds"
            " a '%(mark)s'"
        ),
    ),
    "fields_missing": (N_("has %(fields)s fields, the first line names %(columns)s columns"),),
    "field_without_column": (
        N_("'%(text)s' stands in a column without a name; name the column, or move it to another"),
    ),
    "no_json": (N_("is not JSON: look at line %(row)s, character %(sign)s"),),
    "no_braces": (N_("is no table: a file of measurements begins with a brace"),),
    # Of a cell, whatever its table, or of a key.
    "cell_empty": (N_("is empty"),),
    "id_refused": (N_("'%(text)s' is refused: %(advice)s"),),
    "no_whole_number": (N_("'%(text)s' is not a whole number"),),
    "no_number": (
        N_("'%(text)s' is no number in %(unit)s or in a unit that converts to it"),
        N_("'%(text)s' is no number"),
    ),
    "no_decimal_point": (
        N_("'%(text)s' is no number; write a decimal point, or separate fields by semicolons"),
    ),
    "no_sense": (N_("'%(text)s' is no sense; write cw or ccw"),),
    "two_senses": (N_("'%(text)s' tells two senses; write one: cw or ccw"),),
    "not_finite": (N_("'%(text)s' is no finite number"),),
    "length_range": (N_("'%(text)s': a drawn length is from 0 to %(most)s"),),
    "direction_range": (N_("'%(text)s': a direction is from -360 to 360 degrees"),),
    "too_long": (N_("has more than %(most)s characters"),),
    "signs_no_text": (N_("has signs that are no text"),),
    "there_twice": (N_("'%(text)s' is there more than once"),),
    "not_known": (
        N_("is not known here; did you mean %(near)s?"),
        N_("is not known here; known are %(names)s"),
        N_("is not known here"),
    ),
    "no_braces_inside": (N_("must be a table in braces"),),
    "no_quotes": (N_("must be text in quotes"),),
    "must_be_one": (N_("must be 1"),),
    "lang_unknown": (N_("'%(text)s' is not known; there are %(names)s"),),
    "no_scan": (N_("'%(text)s': a page is written FILE#NUMBER, from 1"),),
    # Of lists of students, and of pages that are given away.
    "no_rows": (N_("there are no rows below the line of column names"),),
    "student_twice": (
        N_("%(student)s in position %(position)s is on line %(first)s already"),
        N_("%(student)s is on line %(first)s already"),
    ),
    "student_case": (
        N_("%(student)s differs in case only from %(other)s on line %(first)s: the two would share a folder"),
    ),
    "position_missing": (N_("is empty, but %(student)s has other lines with positions"),),
    "scan_twice": (N_("%(scan)s is named on line %(first)s already (%(other)s)"),),
    "value_twice": (N_("'%(text)s' is on line %(first)s already"),),
    "no_participant": (N_("'%(text)s' is no participant's number"),),
    "no_preview_page": (N_("'%(text)s' is no page of this preview, or is there twice"),),
    "page_left_out": (N_("the page '%(text)s' is missing"),),
    "yes_or_no": (N_("'%(text)s': write yes or no"),),
    "no_boxes": (N_("write x y width height in pixels of the picture, several with ; between"),),
    # Of decisions.
    "student_empty": (N_("is empty: say whose submission was decided"),),
    "student_nobody": (
        N_("%(student)s is nobody in this class; is %(near)s meant?"),
        N_("%(student)s is nobody in this class"),
    ),
    "student_not_listed": (
        N_("%(student)s is not on the roster; is %(near)s meant?"),
        N_("%(student)s is not on the roster"),
    ),
    "position_open": (
        N_("%(student)s has the positions %(positions)s: write which"),
        N_("%(student)s has no positions: leave it blank"),
    ),
    "criterion_empty": (N_("is empty: write a criterion's id, total, comment, node:... or page:..."),),
    "criterion_unknown": (
        N_("'%(text)s' is not in this rubric; is %(near)s meant?"),
        N_("'%(text)s' is not in this rubric"),
    ),
    "decided_twice": (
        N_("%(criterion)s is decided on line %(lines)s too; leave one line of them"),
        N_("%(criterion)s of %(student)s is decided on another line too; leave one"),
    ),
    "verdict_unknown": (N_("'%(text)s' is none of %(names)s"),),
    "not_blank": (N_("must be empty for %(kind)s"),),
    "comment_empty": (N_("is empty: write it there, or remove the line"),),
    "points_empty": (N_("is empty: write the points to add, or to take away with a minus"),),
    "no_points": (N_("is no number of points"),),
    "points_negative": (N_("are below 0; points are taken away in a row `total`"),),
    "points_above": (N_("%(given)s points are more than the %(most)s of %(criterion)s"),),
    "points_contradict": (
        N_("the points of %(verdict)s are %(most)s, not %(given)s; leave them blank, or write partial"),
        N_("what is not judged has no points; leave them blank"),
    ),
    "no_node": (N_("'%(text)s' is no node: write node:FIGURE:NODE"),),
    "figure_unknown": (N_("'%(text)s' is no figure here: %(names)s"),),
    "node_unknown": (N_("'%(text)s' is no node of %(figure)s: %(names)s"),),
    "no_place": (N_("'%(text)s' is no place: two numbers x,y are right, such as 61.25,140.5"),),
    "place_outside": (
        N_("%(text)s lies beside the sheet of %(wide)s by %(high)s"),
        N_("'%(text)s' lies outside of every sheet"),
    ),
    "page_not_there": (N_("there is no page %(wanted)s of %(source)s in the folder"),),
    "page_open": (N_("%(source)s has %(pages)s pages: write which, page:%(source)s#1"),),
    "page_nothing": (N_("is empty: say owner=STUDENT, turn=90 or corners=x,y x,y x,y x,y"),),
    "page_words": (N_("'%(text)s': owner=, turn= and corners= are known, each once"),),
    "turn_unknown": (N_("turn '%(text)s': one of %(names)s is right"),),
    "corners_count": (N_("corners: four places x,y, parted by blanks, are right, not %(count)s"),),
    "corners_order": (
        N_("corners: give the upright sheet's from the top left clockwise; no three may lie in a line"),
    ),
    "audit_unknown": (N_("'%(text)s': %(names)s are known, then ; said=VERDICT"),),
    # Of results that are exported.
    "two_reports": (N_("has two reports"),),
    "score_range": (N_("the score %(score)s is not between 0 and %(most)s"),),
    "no_maximum": (N_("the maximum is %(most)s"),),
    "maximum_of": (N_("%(most)s points: %(names)s"),),
    "points_range": (N_("%(given)s of %(most)s points"),),
    "points_rough": (N_("%(given)s points"),),
    "other_criteria": (N_("other criteria or points than %(other)s"),),
    "other_result": (N_("holds another result than results.json"),),
    "page_absent": (N_("is not there"),),
    "comment_long": (N_("the comment has more than %(most)s characters"),),
    # Of platforms' files, and of what they would not take.
    "title": (N_("'%(text)s' is no title of an assignment"),),
    "taken_for_number": (N_("%(platform)s takes this for a number; give its own of the user (--ids)"),),
    "no_user": (N_("'%(text)s' is no number of a user of %(platform)s (--ids)"),),
    "no_number_known": (N_("has no number of a participant"),),
    "taken_for_points": (N_("'%(text)s' would be read as the row of points"),),
    "formula": (N_("'%(text)s' would be run as a formula by a spreadsheet"),),
    "same_user": (N_("'%(text)s' is already the %(column)s of %(other)s"),),
    "points_row": (N_("there is no row '%(text)s' below the first"),),
    "points_possible": (N_("'%(item)s' has '%(text)s' points possible"),),
    "no_students": (N_("it has no students"),),
    "of_platform": (N_("it is a file of %(platform)s"),),
    "columns_unknown": (N_("no platform's columns: %(names)s"),),
    "scale_graded": (
        N_("the assignment is graded by a scale, and Moodle would skip points: let it be points"),
    ),
    "comments_first": (N_("feedback comments stand in the first column, where Moodle drops them"),),
    "participant_words": (N_("participants are called by different words: %(names)s"),),
    "participant_form": (N_("'%(text)s' is not 'Participant' and a number"),),
    "participant_twice": (N_("the same participant as in row %(first)s"),),
    "maximum_wrong": (N_("the maximum grade '%(text)s' is no positive number"),),
    "grade_no_number": (N_("the grade '%(text)s' is no number; Moodle would store 0"),),
    "grade_comma": (N_("the grade '%(text)s' has a comma; Moodle would store %(whole)s"),),
    "grade_above": (N_("the grade '%(text)s' is above the maximum; Moodle would skip it"),),
    "identity_missing": (N_("has no %(column)s; the roster gives an email, a table (--ids) the others"),),
    "identity_unknown": (N_("'%(text)s' is no %(column)s that Moodle knows"),),
    "criterion_absent": (
        N_("there %(count)s times; one must be named so"),
        N_("not there; there are %(names)s"),
    ),
    "points_differ": (N_("%(there)s points there, %(here)s in the rubric"),),
    "criterion_extra": (N_("there, and not in the rubric"),),
    "one_number": (N_("two criteria have one number"),),
    # Of calls to a platform.
    "answered": (N_("the platform answered %(status)s: %(text)s"),),
    "answer_no_api": (N_("the answer %(status)s is not one of the platform's API; check --site: %(text)s"),),
    "answer_lost": (N_("no answer (%(error)s); run the same command later"),),
    "answer_unclear": (
        N_(
            "it may have arrived (%(error)s), so it was not repeated; check there, then run the command again"
        ),
    ),
    "token_refused": (N_("the token is refused (%(status)s): %(text)s"),),
    "redirected": (N_("the site redirects to %(text)s, and nothing was sent there; check --site"),),
    "wait_long": (N_("the platform asks to wait %(wait)s; run the same command then"),),
    "rubric_other": (
        N_("the assignment has another rubric, and a second one would delete all points; make the two agree"),
    ),
    "rubric_unseen": (N_("it was sent, but the assignment does not show it; check there"),),
    "guide_filled": (
        N_(
            "the guide there has %(count)s fillings of %(grades)s grades; --replace-guide of export deletes"
            " them"
        ),
    ),
}

WHERE = N_("line %(line)s"), N_("row %(table_row)s")
"""The place of a fault; a column follows behind a comma."""
