"""Texts of the steps, one for each kind; values come in by name."""

from grader.i18n import N_

POLE = N_("Mark the pole %(node)s. It is the image of all fixed points: %(fixed)s.")
PIVOT = N_("Mark the fixed joint %(node)s at x = %(x)s, y = %(y)s (real %(real_x)s and %(real_y)s).")
LAY_OFF = N_("From %(start)s lay off %(segment)s = %(length)s, %(direction)s; it ends in %(node)s.")
LAY_OFF_UNTOLD = N_("From %(start)s lay off %(segment)s, %(direction)s; it ends in %(node)s.")
NOTHING_TO_LAY_OFF = N_("%(name)s is zero here: %(node)s falls on %(start)s.")
CORIOLIS_DIRECTION = N_(
    "perpendicular to the guide: the sliding velocity %(slide)s turned by 90° in the sense of %(rate)s"
)
ON_GUIDE = N_(
    "On the guide of %(node)s lay off %(length)s from the guide's own point, in the direction "
    "%(angle)s: this is %(node)s."
)
TWO_LINES = N_(
    "Through %(first)s draw a line %(first_direction)s, and through %(second)s a line "
    "%(second_direction)s. They meet in %(node)s."
)
TWO_GUIDES = N_("Draw %(first)s and %(second)s. They meet in %(node)s.")
LINE_ON_GUIDE = N_("the guide of %(joint)s")
LINE_OF_JOINTS = N_("the line through %(tail)s and %(head)s")
LINE_THROUGH = N_("the line through %(through)s %(direction)s")
ARC_LEFT = N_(
    "Draw an arc about %(p)s with the radius %(p_radius)s and an arc about %(q)s with the radius "
    "%(q_radius)s. They meet in two points: %(node)s is the one to the left of the line from %(p)s to "
    "%(q)s."
)
ARC_RIGHT = N_(
    "Draw an arc about %(p)s with the radius %(p_radius)s and an arc about %(q)s with the radius "
    "%(q_radius)s. They meet in two points: %(node)s is the one to the right of the line from %(p)s to "
    "%(q)s."
)
ARC_AND_LINE = N_(
    "Draw an arc about %(centre)s with the radius %(radius)s. It meets %(line)s in two points: %(node)s "
    "is the one farther on in the direction %(angle)s."
)
DIVIDE = N_(
    "On the line through %(p)s and %(q)s take %(node)s: %(segment)s = %(ratio)s · %(base)s = "
    "%(length)s, measured from %(p)s."
)
DIVIDE_BACK = N_(
    "On the line through %(p)s and %(q)s take %(node)s on the far side of %(p)s: %(segment)s = "
    "%(ratio)s · %(base)s = %(length)s."
)
SIMILAR = N_(
    "On %(base)s draw the triangle similar to %(model)s, its letters following in the same sense: "
    "%(first)s = %(first_length)s, %(second)s = %(second_length)s. Its third corner is %(node)s."
)
SIMILAR_UNTOLD = N_(
    "On %(base)s draw the triangle similar to %(model)s, its letters following in the same sense. "
    "Its third corner is %(node)s."
)
DIVIDE_UNTOLD = N_("Take %(node)s on the line through %(p)s and %(q)s as the link's points divide it.")
SIMILAR_FLAT = N_(
    "%(node)s divides %(base)s as %(third)s divides %(model)s: %(first)s = %(first_length)s, %(second)s "
    "= %(second_length)s."
)
SIMILAR_TO_NOTHING = N_(
    "%(p)s and %(q)s coincide, and so does %(node)s: the image of a link that does not turn is one point."
)
COINCIDE = N_("Mark %(node)s, the point of link %(link)s that lies under %(other)s at this moment.")
TANGENT = N_(
    "Draw the circle about %(centre)s with the radius %(radius)s and the tangent to it through "
    "%(start)s, which touches it to the right of the way from %(start)s to %(centre)s: it touches in "
    "%(node)s."
)
TANGENT_LEFT = N_(
    "Draw the circle about %(centre)s with the radius %(radius)s and the tangent to it through "
    "%(start)s, which touches it to the left of the way from %(start)s to %(centre)s: it touches in "
    "%(node)s."
)
LOCAL = N_(
    "From %(origin)s go %(x)s in the direction %(x_direction)s, then %(y)s in the direction "
    "%(y_direction)s: this is %(node)s."
)
LOCAL_ON_AXIS = N_("From %(origin)s lay off %(x)s in the direction %(x_direction)s: this is %(node)s.")

PERPENDICULAR = N_("perpendicular to %(link)s")
PARALLEL = N_("parallel to %(link)s")
TOWARDS = N_("parallel to %(link)s, from %(tail)s towards %(head)s")
TURNED_LEFT = N_(
    "perpendicular to %(link)s, a quarter turn counter-clockwise from the direction %(tail)s→%(head)s"
)
TURNED_RIGHT = N_("perpendicular to %(link)s, a quarter turn clockwise from the direction %(tail)s→%(head)s")
GUIDE = N_("parallel to the guide of %(joint)s")
ACROSS_GUIDE = N_("perpendicular to the guide of %(joint)s")
SLOT = N_("parallel to the slot of %(joint)s")
AT_ANGLE = N_("in the direction %(angle)s")
ALONG_GUIDE = N_("along the guide of %(joint)s, in the direction %(angle)s")
