"""The sentences of problems: of files, pages, sheets, owners, numbers, scales and pictures.

Each code has its sentences, the most precise first: the first one whose parameters are all known is used. The
last one needs none, and says the least: class pages count problems by it. Flaws of pictures have more precise
ones for each device.
"""

from grader.language import N_

PROBLEMS: dict[str, tuple[str, ...]] = {
    "file_missing": (
        N_("The file could not be opened (%(error)s); check the path."),
        N_("The file could not be opened: %(why)s; check the path."),
        N_("The file could not be opened."),
    ),
    "link_leads_out": (N_("This is a link to a file elsewhere; hand in the file itself."),),
    "archive_damaged": (
        N_("This archive, or this file of one, cannot be unpacked (%(error)s): download or unpack it anew."),
        N_("This archive, or this file of one, cannot be unpacked: download or unpack it anew."),
    ),
    "archive_encrypted": (N_("The archive asks for a password: unpack it yourself."),),
    "archive_name": (N_("The name leads out of the archive: unpack it yourself, and look what it is."),),
    "archive_nested": (N_("This is an archive in an archive: unpack it yourself."),),
    "archive_too_large": (
        N_("The archive has %(count)s files of %(size)s MB, more than a class can need: split it."),
        N_("It unpacks to %(size)s MB, more than a scan can need: unpack it yourself, and look what it is."),
        N_("It unpacks to more than a scan or a class can need."),
    ),
    "file_empty": (N_("The file is empty; hand it in again."),),
    "file_type_unsupported": (
        N_(
            "The file is named %(suffix)s, but is not a %(kind)s file: scan or export it as JPEG, PNG,"
            " TIFF, HEIC or PDF."
        ),
        N_(
            "The file is of a type that is not read: use JPEG, PNG, TIFF, HEIC or PDF, for measurements"
            " CSV or JSON."
        ),
    ),
    "heic_unreadable": (
        N_(
            "HEIC pictures are not read here (the extra `heic` is not installed); send JPEG: on an iPhone"
            " choose Settings, Camera, Formats, Most Compatible, and take the picture again."
        ),
    ),
    "image_too_large": (
        N_(
            "The image has %(millions)s million pixels, which unpack to %(unpacked)s MB, more than"
            " a sheet can need: scan A3 at 600 dpi or less, in grey."
        ),
        N_("The JPEG has %(scans)s scans, more than %(most)s: save it again."),
        N_("The image is too large; scan at 600 dpi or less."),
    ),
    "file_too_large": (
        N_("The file has %(size)s MB, more than %(most)s MB: split it, or scan at 300 dpi."),
        N_("The file is too large; split it, or scan at 300 dpi."),
    ),
    "file_changed": (N_("The file changed while the folder was read; grade again."),),
    "storage_unreadable": (
        N_("The file could not be read from where it is stored (%(error)s); grade again."),
        N_("The file could not be read from where it is stored; grade again."),
    ),
    "image_too_small": (
        N_(
            "The image has %(wide)s by %(high)s pixels, too few or too narrow for a drawing: scan"
            " the whole sheet at 300 dpi."
        ),
        N_("The image is too small or too narrow for a drawing; scan the whole sheet."),
    ),
    "image_damaged_rows": (
        N_(
            "Rows %(first)s to %(last)s of the image are damaged, and lengths read there would be"
            " wrong: scan it again, or grade it by hand."
        ),
        N_("Rows of the image are damaged; scan it again, or grade it by hand."),
    ),
    "image_damaged": (
        N_("The image is damaged (%(error)s); scan or export it again."),
        N_("The image is damaged: %(why)s; scan or export it again."),
        N_("The image is damaged; scan or export it again."),
    ),
    "image_truncated": (N_("The image is cut off before its end; upload it again."),),
    "pdf_encrypted": (N_("The PDF asks for a password; save it without one."),),
    "pdf_damaged": (
        N_("The PDF is damaged (%(error)s); export it again."),
        N_("The PDF is damaged: %(why)s; export or upload it again."),
        N_("The PDF is damaged; export it again."),
    ),
    "page_missing": (
        N_("There is no page %(wanted)s; the file has %(pages)s."),
        N_("The file has no such page."),
    ),
    "pages_too_many": (
        N_("The document has %(pages)s pages, more than %(most)s: split it."),
        N_("The document has too many pages; split it."),
    ),
    "page_blank": (N_("The page is blank and was skipped."),),
    "page_calculations": (
        N_("The page has calculations and no drawing: it is kept, and read by people only."),
    ),
    "page_not_a_drawing": (
        N_("The page is no drawing: %(why)s. Scan it in greyscale, dark lines on white paper."),
        N_(
            "The page is no drawing: it has far too many lines, or its tones are inverted. Scan it"
            " in greyscale."
        ),
    ),
    "squared_paper": (
        N_(
            "The paper is squared: its lines, printed every %(pitch)s, were taken out. Strokes"
            " along one may be lost if no darker."
        ),
        N_(
            "The paper is squared: its printed lines were taken out. Strokes along one may be lost"
            " if no darker."
        ),
    ),
    "title_block_unsure": (
        N_("An area of %(wide)s by %(high)s at the lower right was taken for the title block and left out."),
        N_("A large area at the lower right was taken for the title block and left out."),
    ),
    "calibration_page": (N_("This is the calibration page, not a drawing."),),
    "print_scaled": (
        N_(
            "By the file's resolution the printed sheet has %(size)s of its size: it was printed or"
            " copied at another scale, or the resolution is wrong."
        ),
        N_("The sheet was printed or copied at another scale than 1:1."),
    ),
    "resolution_wrong": (
        N_("By the resolution that the file states the page is %(wide)s by %(high)s, not A3."),
        N_("The resolution that the file states is wrong."),
    ),
    "resolution_assumed": (
        N_("The file states no resolution: %(assumed)s were assumed, by which the page is A3."),
        N_("The file states no resolution; a usual one was assumed."),
    ),
    "registration_disagrees": (
        N_(
            "The frame and the paper's edges cannot be told apart, and no resolution says which is"
            " which: lengths may be %(rival)s off. Scan it again with the stated resolution kept."
        ),
        N_("Frame, paper and resolution disagree by %(off)s."),
        N_("Frame, paper and resolution disagree about the sheet's size."),
    ),
    "paper_assumed": (N_("Only the paper's edges give the scale; the paper was taken for A3."),),
    "frame_missing": (
        N_(
            "No drawing frame was found; positions on the sheet are rough, and a copy's lengths are"
            " known to %(copy)s only."
        ),
        N_("No drawing frame was found; positions on the sheet are rough."),
    ),
    "scale_by_drawing": (
        N_(
            "By %(by)s, lengths are %(longer)s longer than by frame, paper and resolution"
            " (±%(se)s); the page's scale was corrected."
        ),
        N_(
            "By %(by)s, lengths are %(shorter)s shorter than by frame, paper and resolution"
            " (±%(se)s); the page's scale was corrected."
        ),
        N_("The page's scale was corrected by lengths that are known: links and given vectors."),
    ),
    "scale_doubtful": (
        N_("By %(by)s, the page has another scale than its registration says: lengths may be off by %(se)s."),
        N_("Lengths that are known contradict the page's scale: lengths may be off."),
    ),
    "scale_unknown": (
        N_("Only the drawing can tell the page's scale, with its own scales declared: %(why)s."),
        N_("Only the drawing can tell the page's scale, with its own scales declared."),
    ),
    "upright_unsure": (N_("No title block shows which way up the sheet is."),),
    "sheet_refused": (
        N_("The sheet could not be placed: %(why)s; %(advice)s."),
        N_("The sheet could not be placed: %(why)s."),
        N_("The sheet could not be placed: no frame, paper edge or marker settles it."),
    ),
    "nothing_handed_in": (N_("Nothing was handed in."),),
    "nothing_usable": (N_("Nothing that was handed in can be used."),),
    "nothing_read": (N_("No figure of this assignment could be read on the pages handed in."),),
    "sheet_mirrored": (
        N_(
            "The drawing fits far better as a mirror image: the sheet was scanned or photographed"
            " mirrored, or drawn so. Look at it, and ask for the sheet as it was drawn."
        ),
    ),
    "sheet_of_another": (
        N_(
            "The drawing fits the assignment %(other)s far better than %(own)s: was it handed in under the"
            " wrong assignment?"
        ),
        N_("The drawing fits another assignment far better: was it handed in under the wrong one?"),
    ),
    "position_unclear": (
        N_("It is not clear which position this plan belongs to: %(positions)s."),
        N_("It is not clear which position this plan belongs to."),
    ),
    "variant_unknown": (N_("This student's number or position is not known; enter it in the roster."),),
    "n_disagrees": (
        N_("Sources disagree about the student's number: %(numbers)s."),
        N_("The sheet was printed for n = %(printed)s, not for %(given)s."),
        N_("Sources disagree about the student's number."),
    ),
    "position_disagrees": (
        N_("Sources disagree about the student's position: %(numbers)s."),
        N_("The sheet was printed for position %(printed)s, not for %(given)s."),
        N_("Position %(given)s of %(student)s is not among those on the roster (%(positions)s)."),
        N_("Sources disagree about the student's position."),
    ),
    "n_range": (N_("The assignment has no such number."),),
    "position_range": (N_("The assignment has no such position."),),
    "number_read": (
        N_("Read on the sheet: %(read)s (%(confidence)s); %(why)s."),
        N_("The number was read on the sheet; check it."),
    ),
    "number_differs": (
        N_(
            "The sheet reads %(what)s = %(read)s (%(confidence)s); it was graded as %(graded)s,"
            " from which the drawing differs. Check it."
        ),
        N_("The sheet has another number than the roster, and the drawing differs from the roster's."),
    ),
    "number_contradicted": (
        N_(
            "The sheet seems to read %(read)s (%(confidence)s), but the drawing looks like"
            " %(looks)s. Check it, and enter the number in the roster."
        ),
        N_("The number on the sheet is not the one that the drawing follows."),
    ),
    "number_doubtful": (
        N_(
            "The sheet seems to read %(read)s (%(confidence)s), and the drawing shows no variant"
            " for certain. Check it, and enter the number in the roster."
        ),
        N_(
            "No number could be read on the sheet; the drawing looks like %(looks)s. Check it, and"
            " enter the number in the roster."
        ),
        N_("The number on the sheet could not be read surely; add it to the roster."),
    ),
    "does_not_assemble": (N_("The mechanism does not assemble with these data."),),
    "assembly_unclear": (N_("The mechanism does not assemble with these data."),),
    "singular": (N_("The velocities are not determined in this position of the mechanism."),),
    "sheet_values": (
        N_("Page %(form)s: there is no room for the computed values of %(values)s; none is printed."),
        N_("The answer sheet's boxes are too small for this assignment."),
    ),
    "sheet_boxes": (
        N_("Page %(form)s: there are too many lengths (%(lengths)s) for boxes; none is printed."),
        N_("The answer sheet's boxes are too small for this assignment."),
    ),
    "sheet_zone_small": (
        N_(
            "Page %(form)s: %(figure)s needs up to %(wide)s by %(high)s at the assignment's scales,"
            " its zone has %(zone_wide)s by %(zone_high)s; it fits at %(fits)s of that size."
        ),
        N_("The answer sheet's zones are too small for this assignment."),
    ),
    "sheet_not_flat": (
        N_("The printed markers are up to %(off)s off one plane: the sheet was not flat."),
        N_("The sheet was not flat when it was photographed or scanned."),
    ),
    "measurements": (
        N_("The file of measurements cannot be used: %(fault)s; more faults: %(more)s."),
        N_("The file of measurements cannot be used: %(fault)s."),
        N_("The file of measurements has faults."),
    ),
    "measurements_encoding": (N_("The file of measurements is not UTF-8 text."),),
    "measurements_unreadable": (
        N_("The file of measurements cannot be used: %(fault)s."),
        N_("The file of measurements could not be read."),
    ),
    "measurement_fault": (
        "%(fault)s",
        N_("... more faults: %(more)s"),
        N_("A measured value could not be used."),
    ),
    "measurement_columns": (
        N_("The unknown column %(column)s was ignored; did you mean %(near)s?"),
        N_("The unknown column %(column)s was ignored."),
        N_("Unknown columns of the measurements were ignored."),
    ),
    "measurement_not_used": (
        N_("Not drawn in this mechanism's plans, and not judged: %(columns)s."),
        N_("A measured value is not asked for in this assignment."),
    ),
    "roster_columns": (
        N_("Columns of the roster that are not used were ignored: %(columns)s, and %(more)s more."),
        N_("Columns of the roster that are not used were ignored: %(columns)s."),
        N_("Columns of the roster that are not used were ignored."),
    ),
    "scale_refused": (
        N_("The declared %(scale)s, “%(text)s”, could not be understood: %(why)s."),
        N_("A declared scale could not be understood."),
    ),
    "scale_box_unread": (
        N_("%(scale)s on the sheet could not be read; enter it in the roster or with the measurements."),
        N_("A scale written on the sheet could not be read."),
    ),
    "scale_box_doubtful": (
        N_(
            "%(scale)s on the sheet seems to read “%(read)s” (%(confidence)s), %(why)s. Check it,"
            " and enter %(scale)s."
        ),
        N_("A scale written on the sheet could not be read surely; it was not used."),
    ),
    "scale_box_disagrees": (
        N_(
            "%(scale)s on the sheet reads “%(read)s” (%(confidence)s), in the roster “%(roster)s”,"
            " which is used."
        ),
        N_(
            "%(scale)s on the sheet reads “%(read)s” (%(confidence)s), in the measurements"
            " “%(measurements)s”, which is used."
        ),
        N_("%(scale)s on the sheets reads %(readings)s: none of them is used. Check it."),
        N_("A scale written on the sheet contradicts another declaration of it."),
    ),
    "scale_disagrees": (
        N_(
            "%(scale)s is %(roster)s in the roster, %(measurements)s in the measurements: none is"
            " used. Correct one of them."
        ),
        N_("%(scale)s is %(measurements)s in the measurements: none is used. Correct one of them."),
        N_("Sources disagree about a scale; none of them is used."),
    ),
    "measurements_twice": (
        N_("%(student)s is in %(places)s: both count."),
        N_("There are several sets of measurements; they were taken together."),
    ),
    "measurements_disagree": (
        N_("Different values of %(column)s: %(values)s. None of them is used."),
        N_("Sets of measurements disagree; what they disagree about is not used."),
    ),
    "measurements_unmatched": (
        N_("%(student)s differs in case only from %(other)s, and the two would share a folder."),
        N_("%(student)s is not on the roster."),
        N_("Nothing says whose measurements these are: %(fault)s; more faults: %(more)s."),
        N_("Nothing says whose measurements these are: %(fault)s."),
        N_("Nothing says whose measurements these are."),
    ),
    "not_explained": (
        N_("These vectors do not belong together: %(unfit)s of %(of)s fit nothing."),
        N_("The vectors do not belong together: no explanation fits them. A person must look."),
    ),
    "owner_unknown": (
        N_("Nothing says whose page this is. Is %(near)s meant?"),
        N_("Nothing says whose page this is, and its name is no student's id: %(why)s."),
        N_("Nothing says whose page this is."),
    ),
    "owner_name": (
        N_(
            "The platform's name of it says %(name)s, whom no student of the roster fits for certain: enter"
            " the file in the roster's column scans."
        ),
        N_("The platform's name of it fits no student of the roster for certain."),
    ),
    "owner_disagree": (
        N_("Sources disagree about whose page this is: %(claims)s."),
        N_("Sources disagree about whose page this is."),
    ),
    "owner_not_listed": (
        N_("The page names a student who is not on the roster: %(claims)s."),
        N_("The page names a student who is not on the roster."),
    ),
    "owner_ambiguous": (
        N_("%(student)s has the positions %(positions)s, and nothing says which one this is."),
        N_("The student has several positions, and nothing says which one this is."),
    ),
    "owner_other_assignment": (
        N_("The page's QR code belongs to %(printed)s, not to %(assignment)s."),
        N_("The page belongs to another assignment."),
    ),
    "order_refused": (
        N_("The roster's order cannot be used for these pages: %(why)s."),
        N_("The roster's order cannot be used for these pages."),
    ),
    "scan_missing": (
        N_("%(student)s has %(scan)s among the scans, and the last page of the file is %(pages)s."),
        N_("%(student)s has %(scan)s among the scans, which is not in the folder. Is %(near)s meant?"),
        N_("%(student)s has %(scan)s among the scans, which is not in the folder."),
        N_("A scan that the roster names is not there."),
    ),
    "decision_fault": ("%(fault)s", N_("A line of the decisions cannot be used.")),
    "decision_not_applied": (
        N_("%(criterion)s is not applied: %(why)s."),
        N_("A person's decision could not be applied."),
    ),
    "crashed": (
        N_("Reading the file was interrupted: %(why)s. Grade again."),
        N_("The program crashed on it (exit code %(exit)s): scan or export it again."),
        N_("The file ended the program that read it; scan or export it again."),
    ),
    "too_slow": (
        N_("It took more than %(limit)s: scan or export it again, or raise the time limit."),
        N_("Reading the file took too long; scan or export it again."),
    ),
    "too_much_memory": (
        N_("It needs more than %(limit)s MB of memory: scan or export it again, or raise the memory limit."),
        N_("Reading the file took too much memory; scan or export it again."),
    ),
    "internal_error": (
        N_("This could not be processed because of an error in the program (%(error)s)."),
        N_("This could not be processed because of an error in the program."),
    ),
    "sheet_letters": (
        N_("The font has no %(letters)s: boxes stand in the name of %(student)s instead."),
        N_("The font lacks letters of a name; boxes stand instead."),
    ),
    "cluster_versions": (N_("A worker runs another version of the program."),),
    "blurred": (N_("The picture is blurred."),),
    "shadow": (N_("A shadow lies on the sheet."),),
    "too_dark": (N_("The picture is too dark."),),
    "overexposed": (N_("The picture is too bright, the lines fade."),),
    "glare": (N_("Light is reflected on the sheet."),),
    "too_coarse": (N_("The picture has too few pixels."),),
    "far_away": (N_("The sheet fills too little of the picture."),),
    "too_tilted": (N_("The sheet was photographed from one side."),),
    "not_placed": (N_("The sheet's edges could not be followed."),),
    "no_sheet": (N_("No sheet was found in the picture."),),
    "corner_cut": (N_("A corner of the sheet is not in the picture."),),
}

_DARK_PART = N_(
    "A part of the sheet is dark (%(areas)s): press the sheet flat on the glass, and close the lid."
)
_COARSE_SCAN = N_(
    "The scan has too few pixels (%(measured)s of the %(limit)s dots per inch of paper that are needed): scan"
    " at 200 dpi or more."
)
_NO_SHEET_SCANNED = N_(
    "No A3 drawing was recognised in the scan: scan the whole sheet in one piece, with its frame and edges."
)
_CUT_BY_SCANNER = N_(
    "Not in the scan: %(corners)s. Scan the whole sheet; an A3 sheet needs a scanner for A3, or a photo."
)
ADVICE: dict[str, dict[str, str]] = {
    "blurred": {
        "camera": N_(
            "The picture is blurred: wipe the lens, tap on the sheet so that the camera focuses, and"
            " hold the phone still with both hands."
        ),
        "scanner": N_(
            "The scan is blurred: press the sheet flat on the glass, close the lid, and scan again."
        ),
    },
    "shadow": {
        "camera": N_(
            "A shadow lies on the sheet (%(areas)s): put the lamp to one side, or stand so that neither"
            " you nor the phone shades the sheet."
        ),
        "scanner": _DARK_PART,
        "copier": _DARK_PART,
    },
    "too_dark": {
        "camera": N_("The picture is too dark: photograph by daylight or under a bright lamp."),
        "scanner": N_("The scan is too dark: set the brightness higher, and scan in greyscale."),
        "copier": N_("The copy is too dark: set the copier lighter, or scan the sheet itself in greyscale."),
    },
    "overexposed": {
        "camera": N_(
            "The picture is too bright, the lines fade: tap on the sheet to set the brightness, and"
            " switch the flash off."
        )
    },
    "glare": {
        "camera": N_(
            "Light is reflected on the sheet (%(areas)s): switch the flash off, or move the sheet away"
            " from the lamp."
        )
    },
    "too_coarse": {
        "camera": N_(
            "The picture has too few pixels (%(measured)s of the %(limit)s dots per inch of paper that"
            " are needed): send the original photo, not a reduced copy."
        ),
        "scanner": _COARSE_SCAN,
        "copier": _COARSE_SCAN,
    },
    "far_away": {
        "camera": N_("The sheet fills too little of the picture: go nearer until it fills the picture.")
    },
    "too_tilted": {
        "camera": N_(
            "The sheet was photographed from one side, so that its far side is too small: hold the"
            " phone level above the middle of the sheet."
        )
    },
    "not_placed": {
        "camera": N_(
            "The sheet's edges could not be followed: lay it flat, with a strip of a darker table"
            " around it, and hold the phone level above its middle."
        )
    },
    "no_sheet": {
        "camera": N_(
            "No sheet was found in the picture: lay the sheet flat on a table of another colour, and"
            " photograph it from above with all four corners in view."
        ),
        "scanner": _NO_SHEET_SCANNED,
        "copier": _NO_SHEET_SCANNED,
    },
    "corner_cut": {
        "camera": N_(
            "Not in the picture: %(corners)s. Step back until all four corners of the sheet are in view."
        ),
        "scanner": _CUT_BY_SCANNER,
        "copier": _CUT_BY_SCANNER,
    },
}
"""Sentences that say what to do about a flaw of a picture, by the `device` that made it."""
