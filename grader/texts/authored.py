"""Faults of files that authors write: mechanisms, assignments, rubrics, tables of variants, formulas.

Each code has its texts, the most precise first: the first one is said whose parameters are all known. The
remarks of a fault stand behind it in brackets.
"""

from grader.language import N_

REMARKS: dict[str, tuple[str, ...]] = {
    "near": (N_("did you mean %(near)s?"),),
    "types": (N_("types are %(types)s"),),
    "sides": (N_("a side is %(sides)s"),),
    "letters": (N_("%(letters)s: type it on a Latin keyboard"),),
    "variant": (N_("for %(variant)s and %(more)s more"), N_("for %(variant)s")),
}
"""By the parameter that they tell, where the fault's own text does not."""

AUTHORED: dict[str, tuple[str, ...]] = {
    # Of a file as a whole, and of values whatever their key
    "no_such_file": (N_("there is no such file"),),
    "rubric_given": (N_("is a rubric: name the file of an assignment that uses it"),),
    "mechanism_given": (N_("is a mechanism: name the file of an assignment that uses it, or write one:"
        " planmark new --mechanism"),),
    "text_not_utf8": (N_("is not UTF-8 text; save it as UTF-8"),),
    "file_large": (N_("is larger than %(most)s kB: nothing that is written by hand is"),),
    "nested": (N_("is nested deeper than %(most)s"),),
    "more_faults": (N_("more faults: %(count)s"),),
    "not_toml": (N_("is not TOML: %(text)s (%(advice)s)"),),
    "line_form": (N_("write KEY = VALUE or [TABLE], the key of A-Z a-z, digits, _ and -; or a bracket"
        " above is not closed"),),
    "key_twice": (N_("this key stands above already"),),
    "value_missing": (N_("the value behind the equals sign is missing"),),
    "text_unquoted": (N_("a text stands in straight quotes"),),
    "decimal_point": (N_("write a decimal point"),),
    "number_alone": (N_("a number stands alone, without its unit, and a formula in quotes"),),
    "quote_unclosed": (N_("a quote is opened and never closed"),),
    "two_brackets": (N_("the table stands on line %(other)s, too: write [[%(name)s]] on each where several"
        " may stand, else keep one"),),
    "key_missing": (N_("is missing"),),
    "side_missing": (N_("is missing: without it two assemblies are possible, and the mechanism is never"
        " guessed"),),
    "key_unknown": (N_("is not known here; check its spelling"),),
    "of_the_file": (N_("belongs to the file, not to this table: write it above the first [table]"),),
    "of_another_table": (N_("does not belong here: another kind of table has it; leave it out"),),
    "one_of": (N_("must be one of %(names)s"),),
    "number_in_quotes": (N_("must be a number, without quotes"),),
    "number_unusable": (N_("is no number that can be computed with"),),
    "limit": (
        N_("'%(text)s' (%(name)s) must be %(limit)s"),
        N_("'%(text)s' must be %(limit)s"),
    ),
    "true_or_false": (N_("must be true or false"),),
    "must_be_table": (
        N_("must be a table: [%(name)s], not [[%(name)s]]"),
        N_("must be a table"),
    ),
    "must_be_list": (
        N_("must be a list of tables: [[%(name)s]], not [%(name)s]"),
        N_("must be a list, in square brackets"),
    ),
    "list_long": (N_("must have at most %(most)s entries, not %(count)s; a number has a decimal point"),),
    "list_short": (N_("must have at least %(least)s of its entries, not %(count)s"),),
    "no_name": (N_("'%(text)s' is no name here: letters A-Z a-z and digits"),),
    "other_form": (N_("has another form than it must have (%(error)s)"),),
    # Formulas
    "no_formula": (N_('a number or a formula in quotes, such as "2*(30+n)", is expected'),),
    "not_formula": (
        N_("'%(text)s' is not a formula: %(advice)s"),
        N_("'%(text)s' is not a formula"),
    ),
    "scale_number": (N_("a scale is a number of metres on a millimetre, 1:2.5 is 0.0025"),),
    "bracket_unclosed": (N_("a bracket is opened and not closed, or closed and not opened"),),
    "unit_of_key": (N_("write the number alone; the key and length_unit say its unit"),),
    "not_in_formulas": (
        N_("'%(text)s': %(advice)s"),
        N_("'%(text)s': only numbers, names, + - * / %% ** and %(names)s may be used"),
    ),
    "name_unknown": (
        N_("'%(text)s': unknown name %(name)s; known: %(names)s"),
        N_("'%(text)s': unknown name %(name)s"),
    ),
    "takes": (N_("'%(text)s': the count of numbers that %(name)s takes is %(count)s"),),
    "exponent_large": (N_("'%(text)s': an exponent must be a number of at most %(most)s"),),
    "no_finite_value": (N_("'%(text)s' does not give a finite number for these data"),),
    # Mechanisms
    "no_joint_name": (N_("'%(text)s' is no joint's name: a capital, then letters or digits (not O or N)"),),
    "no_side": (N_("'%(text)s' is no side here; sides are %(names)s"),),
    "side_or_formula": (N_("must be one of %(sides)s, or a formula: %(why)s"),),
    "side_unknown": (N_("side = '%(text)s' is neither %(first)s nor %(second)s, nor data of a variant"),),
    "side_zero": (N_("side = '%(text)s' is zero: above zero is %(first)s, below %(second)s"),),
    "side_of_plate": (N_("side of %(joint)s is missing: %(joint)s may lie to the left or to the right of"
        " %(first)s -> %(second)s; say which: side"),),
    "cylinder_length": (N_("'%(text)s' (cylinder) must lie between %(least)s and %(most)s m, in line with"
        " the crank"),),
    "no_triangle": (N_("the joints %(names)s form no triangle: DE, EF and FD are the last three lengths"),),
    "offset_zero": (N_("the offset of link %(link)s is zero: leave out offset and foot"),),
    "motion_of_cylinder": (N_("angle, speed and acceleration come from the cylinder: leave out the"
        " crank's"),),
    "crank_needs_angle": (N_("needs angle_deg, or a cylinder that drives it"),),
    "crank_needs_speed": (N_("needs one speed: either omega (rad/s) or rpm (rev/min)"),),
    "ratio_without_rpm": (N_("gear_ratio goes with rpm: the crank then turns at rpm / gear_ratio"),),
    "guide_needs": (N_("needs through and angle_deg (a fixed guide), or joints and coincident (a guide on a"
        " moving link)"),),
    "driving_guide_moves": (N_("a driving slider's guide is fixed; a cylinder that turns drives the link at"
        " its rod's end: [crank] with cylinder = { pivot, length, speed, side }"),),
    "offset_and_foot": (N_("offset and foot go together; foot names the guide's nearest point to the"
        " pivot"),),
    "yoke_needs": (N_("a yoke on a fixed guide needs slot_deg; on a moving one, to which its slot is"
        " perpendicular, it needs link, its own name, and no slot_deg"),),
    "drivers": (N_("needs one driving link: either [crank] or [driving_slider]; planmark solves mechanisms"
        " with one"),),
    "joint_unplaced": (N_("%(joint)s is not placed by any group: known are %(names)s"),),
    "no_ground_pivot": (N_("%(joint)s is not a ground pivot: known are %(names)s"),),
    "joint_placed": (
        N_("%(joint)s has a place already: over-constrained; a group places a new joint; %(why)s"),
        N_("%(joint)s has a place already: over-constrained; a group places a new joint"),
    ),
    "cylinder_missing": (N_('the cylinder itself is missing: a group of type = "RPR", its pin %(joint)s, its'
        " pivot %(fixed)s"),),
    "cylinder_pivot": (N_("the cylinder needs a pivot of its own"),),
    "pin_on_ground": (N_("%(joint)s is a ground pivot already"),),
    "groups_wait": (N_("the groups of %(nodes)s wait for one another: none of them can be placed first"),),
    "free_more": (N_("degrees of freedom: %(free)s (links with the ground: %(links)s, pairs: %(count)s);"
        " planmark solves mechanisms with one driving link"),),
    "free_none": (N_("degrees of freedom: %(free)s (links with the ground: %(links)s, pairs: %(count)s);"
        " nothing moves, or a pair only repeats what others do"),),
    "joint_too_many": (N_("%(names)s cannot move: a joint too many; and another part is free"),),
    "pairs_of_links": (N_("all groups are of the second class: write one for each of these pairs of links,"
        " in this order: %(names)s"),),
    "higher_class": (
        N_("%(names)s form a group of class %(rank)s: not solved; %(advice)s"),
        N_("%(names)s form a group of a higher class than the second: not solved; %(advice)s"),
    ),
    "is_triad": (N_('%(names)s form a triad, a group of class III: write one group of type = "triad"'),),
    "force_plan_of_triad": (N_("force plans of a mechanism with a triad (%(joint)s) are not drawn: leave them"
        " out; plan --json has its forces"),),
    "assur_points": (
        N_("velocities can be found by Assur points, by interpolation between two trial plans, or with"
            " %(link)s as the driving link: all groups are then of the second class"),
        N_("velocities can be found by Assur points, or by interpolation between two trial plans"),
    ),
    "hinge_of_instant": (N_("%(joint)s is a point of link %(link)s for this instant only: hinge it to a"
        ' fixed point of the link, a group of type = "point" on link %(link)s'),),
    "hinge_of_yoke": (N_("%(joint)s is a point of link %(link)s for this instant only: a yoke on a moving"
        " guide carries no further joint"),),
    "all_on_link": (N_("what it is hinged to and slides on is all on one link (%(link)s): nothing moves"
        ' between; a further point of a link is a group of type = "plate" or "point"'),),
    "joint_case": (N_("joint %(joint)s: another one has the same letters in another case"),),
    "joints_alike": (N_("joints %(names)s: %(name)s would have two meanings, one of them %(first)s about"
        " %(second)s; rename one"),),
    "first_leg_fixed": (N_("%(joint)s is fixed: write first a leg from a joint that moves"),),
    "joints_equal": (N_("must be two different joints"),),
    "guides_fixed": (N_("two fixed guides cross in a fixed point: one of them must be on a moving link"),),
    "guide_joints": (
        N_("%(names)s must be two joints of one moving link (links of each: %(carriers)s); %(joint)s is on"
            " link %(link)s for this instant only"),
        N_("%(names)s must be two joints of one moving link (links of each: %(carriers)s)"),
    ),
    "base_joints": (
        N_("must be two joints of link %(link)s (%(names)s); points of a slotted link are given by type ="
            ' "point" from %(base)s'),
        N_("must be two joints of link %(link)s (%(names)s)"),
        N_("must be two joints of link %(link)s, which has none yet"),
    ),
    "pivot_first": (N_("the pivot comes first, then the slotted link's node"),),
    "link_taken": (N_("there is a link %(link)s already: each link needs a name of its own"),),
    "no_type": (N_("'%(text)s' is no type"),),
    "kind_cam": (N_("'%(text)s': replace a cam by its equivalent linkage for the instant, see Cams and gears"
        " in docs/assignments.md"),),
    "kind_gears": (N_("'%(text)s': a gear before the crank is its gear_ratio; replace a pair of gears"
        " between links by its equivalent linkage for the instant, see Cams and gears in"
        " docs/assignments.md"),),
    "kind_geneva": (N_("'%(text)s': a Geneva wheel is a slotted link while the pin is in a slot, type ="
        ' "RPR"'),),
    "kind_not_rigid": (N_("'%(text)s': planmark solves plane mechanisms of rigid links, hinges and"
        " sliders"),),
    "kind_class": (N_("'%(text)s': of groups of a higher class than the second only a ternary link on"
        ' three legs with turning pairs is solved, type = "triad"'),),
    "kind_yoke": (N_("'%(text)s': a block in a yoke on a guide is type = \"RPP\""),),
    "kind_links": (N_("'%(text)s': two links that meet in a joint are type = \"RRR\""),),
    "kind_slot": (N_("'%(text)s': a block in the slot of a turning link is type = \"RPR\""),),
    "kind_slider": (N_("'%(text)s': a rod with a slider on a guide is type = \"RRP\""),),
    "kind_point": (N_("'%(text)s': a third point of a link is type = \"plate\" or \"point\""),),
    "kind_driver": (N_("'%(text)s': a second driving link makes 2 degrees of freedom, and planmark solves"
        " mechanisms with one driving link"),),
    # Masses and loads
    "centre_form": (N_('the centre of mass is "C", a joint of the link, or { base = ["A", "B"], ratio = 0.5'
        " }, or base with at = [x, y]"),),
    "centre_is_joint": (N_('the mechanism has a joint %(joint)s already: write centre = "%(joint)s" if it is'
        " the centre of mass, else rename it"),),
    "slider_centre": (N_("the mass of a slider is at its joint %(names)s: leave out centre"),),
    "body_needs": (N_("needs mass (kg), inertia (kg m^2) or pins; a link without mass has no [[body]]"),),
    "body_twice": (N_("link %(link)s has a [[body]] already: leave one of them out"),),
    "gravity_alone": (N_("no [[body]] has a mass that would weigh: leave gravity out, or add one"),),
    "load_needs": (N_("needs one of force (N) and couple (N m); a load with both is two loads"),),
    "load_point": (N_("is missing: the force acts on link %(link)s at one of %(names)s"),),
    "couple_direction": (N_("a couple has no direction: leave out angle_deg and motion; its sign is its"
        " sense"),),
    "force_direction": (N_("a force needs a direction: either angle_deg, counter-clockwise from +x, or"
        ' motion = "along" or "against", of a slider'),),
    "motion_no_slider": (N_("link %(link)s is no slider on a fixed guide: give angle_deg in place of"
        " motion"),),
    "forces_alike": (N_("the forces on link %(link)s and on link %(other)s would both be called by %(name)s:"
        " rename a link in the mechanism's file"),),
    "force_name": (N_("%(name)s is the name of another force already: give the load another one"),),
    "link_unknown": (N_("%(link)s is not a moving link: known are %(names)s"),),
    "not_carried": (N_("%(joint)s is no point that is fixed on link %(link)s: it carries %(names)s"),),
    "hinged_later": (N_("link %(link)s is hinged to %(joint)s later: its pin is on one of the links"
        " %(names)s"),),
    "pinned_twice": (N_("the pin of %(joint)s is on link %(link)s already"),),
    # Assignments
    "no_file_of_name": (N_("there is no '%(text)s': %(file)s was looked for beside this file and among the"
        " built-in ones"),),
    "variants_many": (N_("has %(count)s variants, more than %(most)s: narrow n or position"),),
    "grid_one_figure": (N_("a page with a grid has one figure, in all positions"),),
    "grid_positions": (N_("a page with a grid needs [variant] position = { from, to }"),),
    "grid_small": (N_("a grid of %(columns)s by %(rows)s has no zone for some of the positions"),),
    "name_of_formulas": (N_("%(name)s has a meaning in formulas already: choose another name"),),
    "range_empty": (N_("the range is empty: 'from' must not exceed 'to'"),),
    "column_too": (N_("%(file)s has a column %(name)s: leave out or rename one of them"),),
    "force_scale_missing": (N_("is missing: a page shows a force plan. Write it in N/mm: kF = 50, or"
        ' "force / 60"'),),
    "force_plans_apart": (N_("force plans share a sheet with the mechanism only: put %(figures)s on another"
        " page"),),
    "force_plan_unknown": (N_("%(joint)s names no group of this mechanism; its force plans are %(texts)s"),),
    # Tables of variants
    "table_forms": (N_('needs either file = "NAME.csv" (a table beside this file), or columns and rows, such'
        ' as columns = ["n", "a [mm]"] and rows = [[1, 40], [2, 45]]'),),
    "is_spreadsheet": (N_("is a spreadsheet: save it as CSV in UTF-8"),),
    "no_heading": (
        N_("'%(text)s' is no heading: a name and its unit are expected, such as l_AB [mm]: letters A-Z a-z,"
            " digits and _"),
        N_("has no heading"),
    ),
    "column_n_missing": (N_("there is no column n (or position), which says whose row it is"),),
    "unit_unknown": (N_("'%(text)s' is no unit known here: there are %(texts)s, or none"),),
    "cells_surplus": (N_("has %(fields)s cells, the heading names %(columns)s columns; a decimal comma needs"
        " semicolons between cells"),),
    "unit_in_cell": (N_("'%(text)s' is no number: the unit stands in the heading, as %(name)s [%(unit)s]"),),
    "row_twice": (N_("%(text)s has a row already (%(first)s)"),),
    "column_holds": (
        N_("column %(name)s of %(file)s holds %(values)s; here it must hold %(names)s"),
        N_("column %(name)s of %(file)s holds %(values)s; a number without a unit is needed here"),
    ),
    "column_not_positive": (N_("%(text)s in column %(name)s of %(file)s: a length must be above zero"),),
    # Rubrics
    "bands_beside": (N_("bands stand in place of partial_factor and partial_share: give one or the other"),),
    "bands_order": (N_("bands must have rising factors and falling shares"),),
    "one_kind": (N_("must have exactly one of %(texts)s"),),
    "figure_of_vector": (N_("has a figure, which only a vector may have"),),
    "point_direction": (N_("must have a direction: a point's distance alone is not judged"),),
    "no_force_plans": (N_("no page of the assignment shows a force plan: leave it out"),),
    "no_own_accelerations": (N_('no page shows the acceleration plan: add one, or say "given"'),),
    "not_in_mechanism": (
        N_("no drawing of this assignment has %(name)s; they have: %(texts)s"),
        N_("no drawing of this assignment has %(name)s"),
    ),
    "id_of_decisions": (N_("%(name)s has a meaning in decisions.csv: choose another id"),),
    "weight_idle": (N_("no criterion belongs to it: none has such a %(name)s"),),
    # Classes: planmark.toml, and rows of a roster
    "no_path": (N_("is no path: %(advice)s"),),
    "path_quotes": (N_("write a path with / or between single quotes: 'lists\\roster.csv'"),),
    "class_assignment": (N_("there is no '%(text)s': the built-in ones are %(names)s; or write the path of a"
        " .toml file"),),
    "no_file_beside": (N_("there is no file %(file)s; write its path relative to the folder of this file"),),
    "row_variant": (
        N_("%(name)s = %(value)s: the assignment has %(name)s = %(texts)s"),
        N_("%(name)s is needed: the assignment has %(name)s = %(texts)s"),
    ),
    # Findings of lint
    "does_not_assemble": (N_("the group of %(node)s does not assemble: its links miss each other by"
        " %(texts)s; check the lengths, the position of the driving link, and the sides of the groups before"
        " it"), N_("the triad of %(node)s does not assemble, or the lines of its legs meet in one"
        " point: check its lengths")),
    "assembly_unclear": (N_("angle_deg of the triad of %(node)s tells no assembly clearly: there are"
        " %(texts)s"),),
    "singular": (N_("the velocities of the group of %(node)s are not determined: its links are in line, its"
        " rod is perpendicular to the guide, or its guides are parallel; choose another position of the"
        " driving link, or two directions"),),
    "another_assembly": (N_("%(node)s is on the side that is given, yet in another assembly than in the"
        " neighbouring variants: a flat position lies between them; give side by a column of a table or by a"
        " formula"),),
    "transmission": (N_("near a singular position: the sine of the transmission angle at %(node)s falls to"
        " %(least)s"),),
    "crossing": (N_("the construction lines of %(nodes)s meet at only %(angle)s; a line 1 mm off moves the"
        " node by %(off)s mm"),),
    "recomputed": (N_("double precision would lose a digit or two: it was computed with more digits"),),
    "predicted_error": (N_("the computed plan may be off by %(text)s of its size"),),
    "ties": (N_("the same drawing within %(least)s mm: %(text)s"),),
    "near_ties": (N_("pairs of variants that differ by less than the rubric's tolerance: %(count)s; a copied"
        " drawing would get full marks, such as that of %(first)s for %(second)s"),),
    "short_vector": (N_("%(name)s is shorter than %(least)s mm at the proposed scales, down to %(length)s"
        " mm"),),
    "zero_vector": (N_("%(name)s is zero: it has a length to be judged, and no direction"),),
    "hard_to_read": (N_("asked vectors shorter than %(least)s mm at the proposed scales: %(each)s of"
        " %(count)s; on scans they are read with less certainty"),),
    "short_unasked": (N_("not asked for, and shorter than %(least)s mm (in how many variants, and the"
        " shortest): %(texts)s"),),
    "does_not_fit": (N_("%(figure)s does not fit its zone on the A3 answer sheet: it would at %(size)s of"
        " the proposed size"),),
    "does_not_fit_a3": (N_("the page's figures do not fit side by side into the frame of a plain A3 sheet:"
        " they would at %(size)s of the proposed size"),),
    "no_page": (N_("the rubric needs a figure that no page has: %(figure)s"),),
    "tiny_sketch": (N_("the shortest link is drawn %(length)s mm long: kL is metres on a millimetre, 1:2.5"
        " is 0.0025"),),
    "round_scales": (N_("the proposed scales %(why)s; round ones that fit every variant: %(texts)s; then"
        " %(left)s of %(count)s asked vectors are under %(least)s mm instead of %(now)s; with round scales"
        " of each variant's own %(each)s"),),
    "scales_do_not_fit": (N_("do not fit"),),
    "scales_not_round": (N_("are not round"),),
    "scales_of_its_own": (N_("with round scales of each variant's own no asked vector is under %(least)s"
        " mm"),),
    "short_at_any_scale": (N_("even at the largest round scales that fit the sheet, %(left)s of %(count)s"
        " asked vectors stay under %(least)s mm (%(texts)s): no scale makes them easy to read; a page for"
        " each plan, or a criterion that is optional, would help"),),
    "no_altitude_method": (N_("kL ka is not kv^2: normal components cannot be built by the right triangle"
        " (altitude) method"),),
    "not_translated": (N_("students read English in place of %(texts)s"),),
    "asked_twice": (N_("%(name)s is judged by %(other)s already"),),
    "odd_size": (
        N_("%(text)s beside %(length)s: all lengths here are in one unit; is this one in another?"),
        N_("the longest link is %(length)s: are the lengths in another unit?"),
    ),
    "unused_name": (N_("no formula uses %(text)s"),),
    "unused_joint": (N_("nothing that the rubric asks for depends on %(joint)s"),),
    "unused_figure": (N_("the rubric asks for nothing in this figure: %(figure)s"),),
    "names_nothing": (N_("is neither a node nor a vector nor a scale of this assignment"),),
    "same_for_all": (N_("the mechanism does not depend on %(name)s: every student has the same"),),
    "not_told": (N_("sets the mechanism, and no [[given]] tells it to the student: %(texts)s"),),
    "result_told": (N_("%(name)s is told here, and the rubric asks for it: tell what it is computed from"),),
    "no_vector_asked": (N_("asks for no vector: only what is declared can be marked"),),
    "worst_transmission": (N_("the sine of the transmission angle at %(name)s is %(least)s"),),
    "worst_crossing": (N_("the construction lines of %(name)s meet at %(angle)s"),),
    "worst_room": (N_("on page %(page)s a figure would fit its zone at only %(size)s times the size"),),
    "worst_shortest": (N_("%(name)s is the shortest vector asked for, %(length)s mm"),),
    "worst_none": (N_("all variants are alike"),),
}  # fmt: skip
