"""What one student is told: one description, which the page for the screen and the printed one both show."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from markupsafe import Markup

from grader.feedback import words
from grader.feedback.looks import Look
from grader.feedback.problems import Told
from grader.feedback.sentences import PLACES, Level
from grader.i18n import N_, Tongue
from grader.scene import Picture

SHEET = N_("the sheet")
DETAIL = N_("a closer look")
WHY_WIDENED = N_(
    "Widened: small errors of a careful hand add up to more than the rubric's tolerance here, as they do"
    " where lines meet at a small angle."
)
UNITS = N_(
    "Lengths are millimetres on paper; directions count counter-clockwise from the horizontal to the right."
)


@dataclass(frozen=True, slots=True)
class Row:
    """A criterion; `vector` is empty where it is about a scale."""

    vector: str
    verdict: str
    title: Markup
    name: Markup
    verdict_told: str
    measured: tuple[str, ...]
    expected: tuple[str, ...]
    tolerance: tuple[str, ...]
    points: str
    most: str
    said: Markup


@dataclass(frozen=True, slots=True)
class Action:
    """A mistake, or what is off without one: what happened, what to redo, what it explains, where to see it.

    `alternatives` would explain the same nearly as well.
    """

    title: Markup
    at: Markup
    said: Markup
    alternatives: tuple[Markup, ...] = ()
    redo: tuple[Markup, ...] = ()
    explains: tuple[Markup, ...] = ()
    look: Look | None = None


@dataclass(frozen=True, slots=True)
class Waiting:
    """Criteria that a person must look at for the same reason."""

    why: str
    names: tuple[Markup, ...]


@dataclass(frozen=True, slots=True)
class Sheetful:
    """The looks at one page, and what stands below the first of them."""

    looks: tuple[Look, ...]
    source: str


@dataclass(frozen=True, slots=True)
class ScaleRow:
    """A scale: as declared, with remarks, and as used."""

    name: Markup
    declared: str
    remarks: tuple[str, ...]
    used: str
    assumed: bool


@dataclass(frozen=True, slots=True)
class Leaflet:
    """All of it, in the student's language.

    `tally` counts criteria by verdict, those there are; `not_required` names those that need not be handed
    in and were not, at level `full` with what is right; `has_widened` says that some tolerance was widened.
    """

    speaker: Tongue
    level: Level
    title: str
    student: str
    student_id: str
    about: tuple[str, ...]
    status: str
    score: str
    most: str
    tally: tuple[tuple[str, int], ...]
    problems: tuple[Told, ...]
    actions: tuple[Action, ...]
    waiting: tuple[Waiting, ...]
    waiting_looks: tuple[Look, ...]
    sheets: tuple[Sheetful, ...]
    rows: tuple[Row, ...]
    not_required: tuple[Markup, ...]
    has_widened: bool
    scales: tuple[ScaleRow, ...]
    pictures: tuple[Picture, ...]

    @property
    def shows_expected(self) -> bool:
        """Whether the answers may be seen."""
        return self.level == "full"

    @property
    def has_marks(self) -> bool:
        """Whether anything is marked in a picture."""
        return any(picture.scene.arrows for picture in self.pictures)

    @property
    def has_ghosts(self) -> bool:
        """Whether any expected vector is drawn."""
        return any(picture.scene.ghosts for picture in self.pictures)

    def told(self, look: Look) -> str:
        """What is seen in a look, in words: for those who do not see it."""
        verdicts = {row.vector: row.verdict_told for row in self.rows}
        seen = (f"{name}: {verdicts[name]}" for name in look.names if name in verdicts)
        return f"{self.caption(look)}. {'; '.join(seen)}".rstrip(". ")

    def caption(self, look: Look) -> str:
        """What a look shows, in few words."""
        return self.speaker.gettext({**PLACES, "sheet": SHEET, "detail": DETAIL}[look.kind])

    def below(self, look: Look) -> Markup:
        """The caption as it stands below a look: of a detail, with what is named in it."""
        caption = self.caption(look)
        said = Markup.escape(caption[:1].upper() + caption[1:])
        if look.kind != "detail" or not look.names:
            return said
        return Markup("{}: {}").format(said, Markup(", ").join(map(words.symbols, look.names)))

    @property
    def widening(self) -> str:
        """Why a tolerance is wider than the rubric's; empty where none is."""
        return self.speaker.gettext(WHY_WIDENED) if self.has_widened else ""

    @property
    def footer(self) -> str:
        """How lengths and directions are to be understood."""
        return self.speaker.gettext(UNITS)


@dataclass(frozen=True, slots=True)
class About:
    """What is known of a submission beside its report: how its student and assignment are called."""

    title: str = ""
    student_name: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
