"""The kinematic chain of an authored mechanism: its links and joints, mobility, and Assur groups.

It is counted from what stands in the file, also where its groups cannot be placed one after another:
`refusal` then says why.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from reference.errors import FaultError, Parameter

GROUND = "ground"
MOST_SEARCHED = 14
"""A larger chain is not searched for groups: the number of its parts grows as a power of two."""
LARGEST_GROUP = 6
Links = frozenset[str]


@dataclass(frozen=True, slots=True)
class Chain:
    """Links with the joints on each, the links that meet at each joint, sliding pairs, the driving link."""

    links: Mapping[str, Sequence[str]]
    hinges: Mapping[str, Links]
    slides: Sequence[tuple[str, str]]
    driver: str

    def pairs(self, links: Links, known: Links = frozenset()) -> int:
        """Return the number of lower pairs of links with each other and with known ones.

        A joint of k links is k - 1 hinges.
        """
        hinges = [(met & links, met & known) for met in self.hinges.values()]
        turning = sum(len(met) - (not held) for met, held in hinges if met)
        return turning + sum(1 for pair in self.slides if {*pair} <= links | known and {*pair} & links)

    @property
    def mobility(self) -> int:
        """Degrees of freedom by Chebyshev and Grübler: 3 for each moving link less 2 for each pair."""
        return 3 * (len(self.links) - 1) - 2 * self.pairs(frozenset(self.links))

    def groups(self, driver: str) -> Iterator[Links]:
        """Yield the Assur groups in an order of assembly, from the ground and a driving link.

        Each is the smallest set of links whose pairs with each other and with those before leave it no
        freedom; what is left over where there is none, or too much to search, is yielded as one.
        """
        known = frozenset({GROUND, driver})
        while waiting := frozenset(self.links) - known:
            sizes = range(1, LARGEST_GROUP + 1) if len(waiting) <= MOST_SEARCHED else range(0)
            parts = (frozenset(part) for size in sizes for part in combinations(sorted(waiting), size))
            group = next((p for p in parts if 2 * self.pairs(p, known) >= 3 * len(p)), waiting)
            yield group
            known |= group

    def class_of(self, group: Links) -> str:
        """Return a group's class: by the pairs of its largest contour, rigid or movable; empty if unclear."""
        loops = self.pairs(group) - len(group) + 1
        pairs = [sum(link in met for met in [*self.hinges.values(), *self.slides]) for link in group]
        if loops == 0 and max(pairs) == 3:
            return "III"
        return "IV" if loops == 1 and len(group) == 4 else ""

    def named(self, links: Links) -> tuple[str, ...]:
        """Name links by their joints: ``AB``, ``CDE``; a block as `slider_` and its one joint."""
        names = []
        for link, held in self.links.items():
            joints = [joint for joint in held if joint in self.hinges]
            if link in links:
                names.append("".join(joints) if len(joints) > 1 else f"slider_{held[0]}")
        return tuple(names)


def chain_of(links: Mapping[str, Sequence[str]], slides: Sequence[tuple[str, str]], driver: str) -> Chain:
    """Return the chain; links that share two joints are the one rigid link that they are."""
    for first, second in combinations(links, 2):
        if len({*links[first]} & {*links[second]}) > 1:
            joints = list(dict.fromkeys([*links[first], *links[second]]))
            fewer = {link: held for link, held in links.items() if link != second} | {first: joints}
            onto = [(first if a == second else a, first if b == second else b) for a, b in slides]
            return chain_of(fewer, onto, first if driver == second else driver)
    meeting = {joint: frozenset(link for link in links if joint in links[link])
               for held in links.values() for joint in held}  # fmt: skip
    hinges = {joint: met for joint, met in meeting.items() if len(met) > 1}
    return Chain(links, hinges, slides, driver)


def refusal(chain: Chain) -> FaultError:
    """Return why the links of a file cannot be placed group after group as the file has them."""
    free, joints = chain.mobility, chain.pairs(frozenset(chain.links))
    if free != 1:
        code = "free_more" if free > 1 else "free_none"
        return FaultError(code, free=free, links=len(chain.links), count=joints)
    known, order = frozenset({GROUND, chain.driver}), list[str]()
    for group in chain.groups(chain.driver):
        if 2 * chain.pairs(group, known) > 3 * len(group):
            return FaultError("joint_too_many", names=chain.named(group))
        if len(group) > 2:
            return _of_higher_class(chain, group)
        order.append(" + ".join(chain.named(group)))
        known |= group
    return FaultError("pairs_of_links", names=tuple(order))


def _of_higher_class(chain: Chain, group: Links) -> FaultError:
    """Return the refusal of a group, with ways to its velocities."""
    slides = any(group & {*pair} for pair in chain.slides)
    if chain.class_of(group) == "III" and len(group) == 4 and not slides:
        return FaultError("is_triad", names=chain.named(group))
    known: dict[str, Parameter] = {"names": chain.named(group), "advice": "assur_points"}
    if rank := chain.class_of(group):
        known["rank"] = rank
    for other, held in chain.links.items():
        is_on_ground = other not in {GROUND, chain.driver} and {*held} & {*chain.links[GROUND]}
        if is_on_ground and all(len(one) == 2 for one in chain.groups(other)):
            known["link"] = chain.named(frozenset({other}))
            break
    return FaultError("higher_class", **known)
