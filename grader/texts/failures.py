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
    "results_without_rubric": N_("results.json is of an earlier version, which kept no rubric; grade again"),
    "points_impossible": N_("%(student)s: impossible points; grade again\n%(faults)s"),
    "points_sum": N_(
        "%(student)s: the criteria give %(total)s points together, the score is %(score)s; grade again, or"
        " export grades without criteria"
    ),
    "folder_missing": N_("%(folder)s: there is no such folder"),
    "submissions_missing": N_("%(folder)s: there is no such folder; name the submissions' folder, or a .zip"),
    "archive_missing": N_("%(folder)s: there is no such archive; check its name, and the folder it is in"),
    "submissions_in_file": N_("%(folder)s: is a file; name the submissions' folder (%(near)s), or a .zip"),
    "nothing_to_grade": N_("%(folder)s: there is nothing to grade in this folder"),
    "nothing_came": N_("%(folder)s: no submission here can be graded"),
    "run_unknown": N_("%(folder)s: nothing was graded here; run planmark grade first, then name its --out"),
    "cannot_write": N_("%(file)s: cannot be written (%(error)s); choose another place, or make room"),
    "process_ended": N_("the grading process has ended; start it again: finished marks are kept"),
    "folder_empty": N_("%(folder)s: there is no such folder, or nothing in it"),
    "interrupted": N_(
        "interrupted; %(done)s of %(total)s submissions are marked and kept in %(folder)s; run the same"
        " command to continue"
    ),
    "held": N_("%(file)s: another program has locked it for more than %(limit)s s; close that program"),
    "no_lock": N_("%(file)s: cannot be written: no lock file can be made in its folder (%(error)s)"),
    "file_taken": N_("%(file)s: already exists; name another file, or remove it first"),
    "submissions_moved": N_("%(folder)s: its submissions are no longer in %(was)s; grade them again"),
    "results_in_use": N_(
        "%(folder)s: another run writes its results here (process %(pid)s on %(host)s, since %(began)s,"
        " over %(sheets)s); wait until it ends, or choose another --out"
    ),
    "in_use_unsaid": N_(
        "%(folder)s: another run writes its results here; wait until it ends, or choose another --out"
    ),
    "of_another_assignment": N_(
        "%(folder)s: holds the results of the assignment %(there)s, not of %(given)s; choose another"
        " --out, or remove this folder first"
    ),
    "of_another_folder": N_("%(folder)s: holds results of %(there)s; choose another --out, or remove it"),
    "decisions_missing": N_("%(file)s: there is no such file of decisions"),
    "roster_needed": N_("answer sheets need --roster: a sheet carries its student's code"),
    # A class for others to learn from
    "no_preview": N_("%(file)s: already exists and is no preview; name another file"),
    "scans_moved": N_("%(folder)s: scans are missing (%(names)s); grade again"),
    "nothing_to_give": N_("%(folder)s: no figure was read on any page of this class"),
    "preview_outdated": N_(
        "%(folder)s: scans or decisions have changed since the pages were reviewed; start again without it"
    ),
    "no_page_given": N_("%(file)s: no page is marked yes"),
    "answers_wrong": N_("%(file)s: is no longer a picture; remove the preview, and start again"),
    # A cluster
    "archive_on_cluster": N_(
        "%(file)s: workers of a cluster do not read archives; unpack it into the folder"
    ),
    "cluster_needed": N_("%(folder)s: workers of a cluster read a folder elsewhere; give --cluster ADDRESS"),
    "storage_unreadable": N_(
        "%(folder)s: cannot be read (%(error)s); check the address, and the storage's settings in the"
        " environment, or try later"
    ),
    "name_unusable": N_("%(name)s: no name of a file below the folder; rename it"),
    "cluster_unreachable": N_("%(address)s: no scheduler answers in %(limit)s s; start one: dask scheduler"),
    "no_workers": N_(
        "--cluster %(address)s: no worker within %(limit)s s; start some: dask worker %(address)s"
        " --nworkers 2 --nthreads 1"
    ),
    "not_installed": N_("worker %(worker)s lacks planmark (%(error)s): pip install 'planmark[cluster]'"),
    "cluster_versions": N_(
        "worker %(worker)s has other versions (there / here): %(versions)s; marks could differ: install the"
        " same version everywhere"
    ),
    "cluster_folder": N_(
        "worker %(worker)s cannot read %(folder)s (%(error)s); put the class where all workers see it under"
        " this name, or on s3:// or the like"
    ),
    "cluster_lost": N_(
        "--cluster %(address)s: the scheduler has ended, or has no worker for %(limit)s s; finished marks"
        " are kept; run the same command to continue"
    ),
    "folder_unnamed": N_("name the folder; there is no planmark.toml in the working folder"),
    "results_unnamed": N_("name the folder of results; there is no planmark.toml in the working folder"),
    # Calls of other commands
    "ending": N_("%(option)s %(file)s: the name must end in %(names)s"),
    "extra_missing": N_("a package is missing (%(error)s): pip install 'planmark[%(extra)s]'"),
    "unknown_schema": N_("there is no schema '%(text)s': known are %(names)s"),
    "unknown_language": N_("'%(text)s' is no language of planmark; choose one of %(names)s"),
    "quantity_near": N_("no '%(text)s' on this cycle (did you mean %(near)s?): known are %(names)s"),
    "unknown_quantity": N_("no '%(text)s' on this cycle: known are %(names)s; _x or _y for a component"),
    "cycle_of_cylinder": N_(
        "%(name)s: a cylinder drives the crank, whose speed is known at the variant's position alone; use"
        " planmark plan --all"
    ),
    "altitude": N_("--altitude is drawn on the sketch: name a file by --svg or --pdf"),
    "crank_mm": N_("--crank-mm %(value)s: a length in mm above 0 and below 1000 is needed"),
    "all_or_one": N_("--csv is a table of all variants: add --all"),
    "all_on_pages": N_("%(option)s is the drawing of one variant: drawings of --all go into --pdf"),
    "table_needed": N_(
        "%(file)s: give the values of %(names)s by a CSV with a row for each student, which names them in its"
        " first line beside n (--table)"
    ),
    "no_variant": N_("%(file)s: no variant of it assembles:\n%(findings)s"),
    "table_unused": N_("--table goes with a mechanism of your own: --mechanism FILE.toml"),
    "new_name": N_("'%(text)s': a name of letters, digits, ., _ or - is needed"),
    "like_form": N_('a copy needs other names: write %(names)s as KEY = "NAME", each on a line of its own'),
    "unknown_mechanism": N_("--mechanism %(text)s: there are %(names)s, or a .toml file; or use --like"),
    "token_needed": N_("--host %(host)s opens the class to other machines: give a --token, too"),
    "port_taken": N_("--host %(host)s --port %(port)s: %(error)s; choose another --port, 0 is any free one"),
    "address_needed": N_("--host %(host)s opens the server to others: give --address https://NAME, too"),
    "address": N_("--address %(address)s: write it as https://NAME or http://NAME:PORT"),
    "mail": N_(
        "--mail: write it as smtps://USER:PASSWORD@HOST/SENDER, or with smtp:// where the server does"
        " STARTTLS; SENDER is the address that messages come from"
    ),
    "secret_short": N_("%(option)s must have at least %(least)s characters"),
    "data_base": N_("--database: the data base cannot be opened (%(error)s)"),
    "publication_key": N_("this publication's key cannot name a folder"),
    # Calls of an export
    "unknown_target": N_("'%(to)s' is no export target: known are %(names)s"),
    "unknown_thing": N_("%(to)s is given no '%(what)s': known are %(names)s"),
    "thing_elsewhere": N_("%(to)s is given no '%(what)s': known are %(names)s (or --to %(other)s)"),
    "example_taken": N_(
        "%(option)s: %(what)s = %(value)s is a student's own; choose one that no student has"
    ),
    "option_unused": N_("%(option)s has no meaning for %(what)s: leave it out"),
    "form_unused": N_("a file to fill in has no meaning for %(what)s: leave it out"),
    "unused_beside": N_("%(option)s has no meaning beside %(other)s: leave it out"),
    "maximum_stated": N_("leave out --maximum: %(other)s already states the maximum"),
    "worksheet_of_moodle": N_("--worksheet is Moodle's: give it with --to moodle alone"),
    "read_for_export": N_("%(file)s: is read for this export; name another file (--file)"),
    "number": N_("%(option)s: '%(text)s' is not a number; %(to)s shows the number in its addresses"),
    "maximum": N_("a grade's maximum is a positive number, not %(maximum)s"),
    "maximum_differs": N_(
        "the grade's maximum there is %(there)s, the rubric's is %(here)s: set the same maximum there, or"
        " ask for rescaling (--rescale)"
    ),
    "maximum_in_file": N_(
        "%(file)s: the grade's maximum there is %(there)s, the rubric's is %(here)s: set the same maximum"
        " there, or ask for rescaling (--rescale)"
    ),
    "maxima_differ": N_(
        "students' maxima differ: choose one position, combine them by mean, or convert all to one maximum"
        " (--maximum and --rescale, where the platform is given grades)\n%(faults)s"
    ),
    "maximum_unknown": N_("%(file)s: no maximum grade; look it up in %(platform)s, then give it (--maximum)"),
    "combine": N_("positions cannot be combined by '%(combine)s': choose sum or mean"),
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
    "criteria_differ": N_("rubrics differ; grade all with one rubric, or choose a position\n%(faults)s"),
    "named_twice": N_(
        "the platform would misread this file; nothing was written\n  %(what)s %(name)s appears twice"
    ),
    # Calls of a check
    "measured_needed": N_("--measured FILE is needed; --template FILE writes one for your measurements"),
    "page_file": N_("--page %(file)s: the name must end in .html; print the page for paper"),
    "page_students": N_("--page is one student's: %(file)s holds %(count)s"),
    "template_exists": N_("--template %(file)s: already exists, perhaps filled in; choose another name"),
    "unknown_level": N_("--level %(level)s: known are %(names)s"),
    "unknown_assignment": N_("no assignment '%(name)s'; built in are %(names)s; or give a .toml file's path"),
    "unknown_rubric": N_("no rubric '%(name)s' is built in; give a .toml file's path"),
    "number_needed": N_("--%(name)s is needed: this assignment has %(name)s = %(texts)s"),
    "number_range": N_("%(name)s = %(value)s: this assignment has %(name)s = %(texts)s"),
    "number_disagrees": N_("--%(what)s %(called)s, but %(file)s says %(what)s %(filed)s: which is right?"),
    # Files of a platform
    "not_as_meant": N_("the file would be read back differently; nothing was written"),
    "not_utf8": N_("%(file)s: is not UTF-8 text (byte %(byte)s); download it again and do not resave it"),
    "quote_broken": N_("%(file)s, row %(row)s: text follows a closing quote"),
    "quote_open": N_("%(file)s, row %(row)s: a quote is opened and never closed"),
    "worksheet": N_("%(file)s: Moodle would not take it; download it again and do not resave it\n%(faults)s"),
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
    "gradebook_needed": N_("%(platform)s takes only its own file: download it and give it (--gradebook)"),
    "archive_needed": N_("ILIAS's archive is needed: Multi-Feedback, Download (--gradebook multi_....zip)"),
    "no_archive": N_("%(file)s: is no archive of ILIAS (%(error)s)"),
    "archive_folders": N_("%(file)s: no folders multi_feedback.../Last_First_login_number; download it anew"),
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
    "no_rubric": N_("%(file)s: is no educationRubric with its id and levels"),
    "submissions": N_("%(file)s: no submissions are in this answer; ask for %(asked)s"),
    # Calls of a platform
    "points": N_("Canvas keeps two decimals of a rubric's points; nothing was written\n%(faults)s"),
    "ids": N_("%(student)s: '%(text)s' is no number of a user of %(platform)s (--ids)"),
    "ids_needed": N_("nobody's number in Moodle is known: give a table student_id,id (--ids)"),
    "criteria_many": N_("%(platform)s takes %(most)s criteria, not %(count)s; export totals (--to csv)"),
    "criterion_number": N_("%(file)s: %(name)s: '%(text)s' is no number of a criterion in Moodle"),
    "place_needed": N_("%(to)s needs %(names)s, which say where the rubric goes"),
    "guide_place": N_(
        "which assignment? Give Moodle's core_grading_get_definitions (--criteria), or --cmid, --context-id"
    ),
    "guide_numbers": N_(
        "Moodle's number of the assignment (--assignment-id) and of the criteria (--criteria: its answer to"
        " core_grading_get_definitions, or a CSV table criterion,id) are needed"
    ),
    "other_method": N_(
        "%(file)s: the assignment is graded by '%(text)s', and saving a guide would replace that; choose"
        " 'Marking guide' or 'Simple direct grading' in Moodle first"
    ),
    "guide_exists": N_(
        "the assignment has a guide, or may have one (--criteria tells); saving another deletes it with"
        " everybody's points: if that is meant, give Moodle's answer to"
        " core_grading_get_gradingform_instances (--replace-guide)"
    ),
    # Sending
    "no_plan": N_(
        "%(file)s: holds no calls to send; name what planmark export writes now for canvas-api, openedx,"
        " google-classroom, ms-education, or for Moodle with --what rubric or marks"
    ),
    "site": N_("--site %(text)s: write it as https://NAME"),
    "site_needed": N_("give the address of your %(platform)s: --site https://NAME"),
    "https_needed": N_("--site %(text)s: others could read the token on its way; write https://NAME"),
    "send_token": N_("put the platform's token into the environment as %(name)s, without blanks"),
    "no_record": N_("%(file)s: is no record of what was sent; restore it, or remove it to send all again"),
    "groups": N_(
        "students hand in as groups (%(found)s), and Moodle takes a number in this archive for a group's:"
        " others would get the page; export grades with comments (--worksheet without --what)"
    ),
    "groups_maybe": N_(
        "the worksheet's column %(found)s may be one of groups: if it is none, give --no-groups; else others"
        " would get the page, so export grades with comments (--worksheet without --what)"
    ),
}

USAGE: dict[str, str] = {
    "NoSuchCommand": N_("there is no command %(name)s"),
    "NoSuchOption": N_("there is no option %(name)s"),
    "MissingParameter": N_("%(name)s is missing"),
    "BadOptionUsage": N_("%(name)s needs a value"),
    "BadParameter": N_("%(name)s: this value cannot be used"),
    "int_parsing": N_("%(name)s must be a whole number"),
    "float_parsing": N_("%(name)s must be a number"),
    "greater_than_equal": N_("%(name)s must be at least %(ge)s"),
    "less_than_equal": N_("%(name)s must be at most %(le)s"),
    "UsageError": N_("there are more words than the command takes; put a name with spaces in quotes"),
    "flag": N_("%(name)s takes no value"),
}
"""Errors of the parser of options, by their classes; of values that cannot be used, by pydantic's types."""
SEE_HELP = N_("%(text)s; %(command)s -h shows how to call it")
