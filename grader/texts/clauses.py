"""The clauses of sentences: why something could not be read, placed or understood, and what to do.

Keyed by the value of a reason's parameter ``why`` or ``advice``.
"""

from grader.language import N_

READING: dict[str, str] = {
    "no_stroke": N_("no stroke between %(start)s and %(end)s could be told apart"),
    "blank": N_("nothing is drawn between %(start)s and %(end)s"),
    "upstream_unsure": N_("%(nodes)s, on which it depends, was not read for certain"),
    "scale_vector_unsure": N_("%(vector)s, which shows it, was not read for certain"),
    "no_velocity_plan": N_("no velocity plan was found on the sheets"),
    "no_acceleration_plan": N_("no acceleration plan was found on the sheets"),
    "no_force_plan": N_("no force plan was found on the sheets"),
    "not_found": N_("%(name)s was not found on the sheets"),
    "by_similarity": N_("not drawn: the point %(node)s was found by similarity"),
    "normal_left_out": N_("not drawn: normal component left out"),
    "coriolis_left_out": N_("not drawn: Coriolis component left out"),
    "not_of_assignment": N_("it is not a vector or node of this assignment"),
    "entry": "%(entries)s",
}
"""Reasons why a vector or node was not read."""

PLACING: dict[str, str] = {
    "too_few_pixels": N_("%(long_side)s pixels along the long side are too few for an A3 drawing"),
    "nothing_found": N_("no drawing frame, no paper edges and no resolution that fits A3 were found"),
    "no_one_sheet": N_("the long lines do not form one sheet"),
    "scale_open": N_("the long lines do not determine the scale"),
    "other_scale": N_("the likely frame gives another scale than the resolution"),
    "edges_disagree": N_("the likely frame and paper edges disagree by %(off)s, which no A3 drawing has"),
    "nothing_shows_a3": N_(
        "neither a title block nor frame and paper together show that it is an A3 drawing"
    ),
    "stated_not_a3": N_(
        "by its resolution the page is not A3, and no frame with a title block says otherwise"
    ),
    "not_known_a3": N_(
        "no whole drawing frame, no title block or no stated resolution shows that the page is A3"
    ),
    "as_large_as_a4": N_("no resolution is stated, and the page is as large as A4"),
    "odd_squares": N_(
        "at the scale that was found its printed squares would be %(pitch)s, which no paper has; scan it"
        " again and keep the resolution in the file"
    ),
    "part_in_picture": N_("only %(share)s of the sheet is in the picture"),
    "two_sheets": N_("it shows two sheets side by side: scan or photograph each one by itself"),
    "corners": N_("the corners that were given span no sheet"),
    "not_calibration": N_("this is not the calibration page: print it by `planmark sheet --calibration`"),
    "few_markers": N_("%(markers)s whole markers are seen, at least %(least)s are needed"),
    "dark": N_(
        "half of it is as dark as %(grey)s of 255 or darker: its tones may be inverted, or it was"
        " photographed in the dark"
    ),
    "many_strokes": N_(
        "it has about %(strokes)s straight strokes, where a drawing has a few hundred: it may be a photo, a"
        " printed pattern, or have inverted tones"
    ),
    "halves": N_(
        "an A3 drawing scanned in two halves on A4 cannot be put together: scan it on an A3 scanner or"
        " photograph it whole"
    ),
    "not_by_drawing": N_("the drawing and the declared scales do not show the page's scale either"),
}
"""Reasons why a page could not be placed or is no such drawing, and what to do."""

FILES: dict[str, str] = {
    "no_regular_file": N_("it is a folder or a pipe, not a file"),
    "no_pixels": N_("it has no pixels"),
    "no_header": N_("its header cannot be read"),
    "parts_missing": N_("some of its parts are missing"),
    "wrong_amount": N_("the amount of its data does not match its size"),
    "undecodable": N_("it cannot be decoded"),
    "pdf_cut_off": N_("it is cut off before its end"),
    "pdf_without_pages": N_("it cannot be opened, or has no pages"),
}
"""Reasons why a file cannot be used."""

SCALES: dict[str, str] = {
    "nothing_written": N_("nothing is written"),
    "too_many_characters": N_("it has more than %(most)s characters"),
    "beside_equals": N_("a side of an equals sign is empty"),
    "too_large_number": N_("it is too large a number"),
    "no_rule": N_("“%(said)s” is no rule for %(scale)s"),
    "no_omega": N_("a slider drives this mechanism, so that there is no omega of a crank"),
    "not_positive": N_("“%(said)s” is no positive number"),
    "undrawable": N_("nothing can be drawn at the scale “%(said)s”"),
    "no_unit": N_("“%(said)s” has no unit: write it after the number; units are never guessed"),
    "no_length": N_("“%(said)s” is not a length per length on paper"),
    "no_velocity": N_("“%(said)s” is not a velocity per length on paper"),
    "no_acceleration": N_("“%(said)s” is not an acceleration per length on paper"),
    "no_force": N_("“%(said)s” is not a force per length on paper"),
    "division_by_zero": N_("it divides by zero"),
    "not_understood": N_("“%(sign)s” is not understood in “%(said)s”"),
    "unfinished": N_("“%(said)s” breaks off"),
    "two_numbers": N_("“%(said)s” has two numbers side by side"),
    "zero_power": N_("“%(said)s” has a power of zero"),
    "open_bracket": N_("“%(said)s” has a bracket that is not closed"),
    "odd_power": N_("“%(said)s” has a power that is not understood"),
    "not_two_numbers": N_("“%(said)s” is not a ratio of two numbers"),
    "ratio_of_lengths": N_("“%(said)s” is a ratio of lengths"),
    "not_one_unit": N_("“%(said)s” does not begin with one unit on paper, such as 1 mm"),
    "too_unsure": N_("too uncertain to be used"),
    "not_borne_out": N_("which neither the drawing nor the assignment's rule confirms"),
}
"""Reasons why a declared scale could not be understood, or was not used."""

OWNERS: dict[str, str] = {
    "looks_like": N_("the drawing looks like the variant of %(students)s"),
    "no_page_found": N_("no page was found"),
    "drawn_like_it": N_("the drawing looks like it"),
    "drawn_unclear": N_("the drawing shows no variant for certain"),
    "several_files": N_("one class file is expected, and there are %(count)s: %(files)s"),
    "uneven": N_(
        "%(pages)s pages that are not blank cannot be %(each)s for each of %(rows)s lines of the roster;"
        " name each student's pages in the roster's column scans"
    ),
    "disproved": N_("page %(at)s disproves it: %(claims)s"),
    "id_letters": N_("letters A-Z a-z, digits, '.', '_' and '-', at most 64, are allowed"),
    "id_dot": N_("it cannot name a folder: it begins or ends with a dot"),
    "id_device": N_("it cannot name a folder: Windows has a device of that name"),
    "id_result": N_("it cannot name a folder: a file of the results has that name"),
    "killed": N_("the process that worked on it was killed"),
    "workers_lost": N_("every worker that worked on it was lost"),
    "no_page_has_figure": N_("none of the student's pages has this figure; decide the verdicts in its place"),
    "handed_in_changed": N_("what was handed in has changed since"),
    "data_changed": N_(
        "the student's number or position, the scales or the assignment's data have changed since"
    ),
    "asked_changed": N_("the criterion now asks for something else, or the page was placed again"),
    "page_gone": N_("the page is not in the folder any more"),
    "nothing_judged": N_("nothing was judged; decide the verdicts of criteria first"),
}
"""The evidence for a page's owner and number, and why something was not done or applied."""

CLAUSES: dict[str, str] = {**READING, **PLACING, **FILES, **SCALES, **OWNERS}

CLAIMS: dict[str, tuple[str, str]] = {
    "by_person": (N_("a person: %(claim)s"), N_("a person")),
    "by_code": (N_("the QR code: %(claim)s"), N_("the QR code")),
    "by_scans": (N_("the roster's scans: %(claim)s"), N_("the roster's scans")),
    "by_name": (N_("the file's name: %(claim)s"), N_("the file's name")),
    "by_platform": (N_("the platform's name of it: %(claim)s"), N_("the platform's name of it")),
    "by_writing": (N_("the name on the sheet: %(claim)s"), N_("the name on the sheet")),
    "by_order": (N_("the roster's order: %(claim)s"), N_("the roster's order")),
    "by_roster": (N_("the roster: %(claim)s"), N_("the roster")),
    "by_content": (N_("the file's content: %(claim)s"), N_("the file's content")),
}
"""Claim of a source about an owner, by the name of the parameter; and the source alone."""
