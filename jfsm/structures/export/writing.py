"""Expressions as lines of a language."""

import textwrap
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from .equations import STICK_SPEED, Equations, TermEquations
from .expressions import Expression

_WIDTH = 110
"""Characters of a line of words."""
_LONGEST = 70
"""Characters of a part of a formula beyond which it gets a name of its own."""
_INFIX = {
    "or": (1, "|"), "and": (2, "&"), "gt": (3, ">"), "ge": (3, ">="), "lt": (3, "<"), "le": (3, "<="), "eq": (3, "=="),
    "ne": (3, "!="), "add": (4, "+"), "sub": (4, "-"), "mul": (5, "*"), "div": (5, "/"), "pow": (7, "**"),
}  # fmt: skip
"""How tightly an operator binds, and its sign."""
_LOGIC = ("and", "or", "gt", "ge", "lt", "le", "eq", "ne")
_NEGATIVE, _POWER, _ATOM = 6, 7, 9


@dataclass(frozen=True)
class Language:
    """How a language writes numbers, operators, functions and comments."""

    functions: dict[str, str]
    signs: dict[str, str] = field(default_factory=dict)
    constants: dict[float, str] = field(default_factory=dict)
    comment: str = "#"
    end: str = ""
    first: int = 0
    brackets: str = "[]"
    choice: str = ""
    """How it chooses, of condition, yes and no, where that is no function."""
    own: str = ""
    """What stands before the name of a number of a term."""

    def item(self, name: str, place: int) -> str:
        """A component of a vector, counted from 0."""
        return f"{name}{self.brackets[0]}{place + self.first}{self.brackets[1]}"

    def number(self, value: float | bool | str) -> str:
        if value in self.constants and not (value == 1 or value == 0) or isinstance(value, bool):
            return self.constants[value]
        return repr(float(value))

    def matrix(self, rows: np.ndarray) -> str:
        """Rows of numbers as they stand between brackets."""
        return "; ".join(", ".join(self.number(value) for value in row) for row in rows.tolist())

    def relative(self, name: str, at: tuple[int, int]) -> str:
        """The motion of a link's ends, relative to each other."""
        i, j = (None if end == 0 else self.item(name, end - 1) for end in at)
        return f"{j} - {i}" if i and j else j or f"-{i}"


class Lines:
    """Lines of a function body; parts of formulas that are long or used twice have names s1, s2, …"""

    def __init__(self, language: Language, names: Iterable[str]):
        self.language, self.names = language, set(names)
        self.lines: list[str] = []

    def comment(self, text: str) -> None:
        self.lines += [f"{self.language.comment} {line}" for line in textwrap.wrap(text, _WIDTH)]

    def set(self, name: str, text: str) -> None:
        self.lines.append(f"{name} = {text}{self.language.end}")

    def formulas(self, roots: Iterable[Expression]) -> list[str]:
        """What expressions are, once the lines before have run."""
        roots = list(roots)
        uses = Counter[Expression]()

        def count(expression: Expression) -> None:
            uses[expression] += 1
            if uses[expression] == 1:
                for operand in expression.operands:
                    count(operand)

        for root in roots:
            count(root)
        kept: dict[Expression, str] = {}
        return [self._text(root, uses, kept, True)[0] for root in roots]

    def _text(
        self, e: Expression, uses: Counter[Expression], kept: dict[Expression, str], is_root: bool = False
    ) -> tuple[str, int]:
        """An expression, and how tightly its outermost operator binds."""
        if e in kept:
            return kept[e], _ATOM
        language = self.language
        if e.operation == "number":
            text = language.number(e.value)
            return text, _NEGATIVE if text.startswith("-") else _ATOM
        if e.operation == "symbol":
            return self._symbol(str(e.value)), _ATOM
        operands = [self._text(operand, uses, kept) for operand in e.operands]
        text, binds = self._operation(e.operation, operands)
        if uses[e] > 1 or len(text) > _LONGEST and not is_root:
            kept[e] = f"s{len(kept) + 1}"
            self.set(kept[e], text)
            return kept[e], _ATOM
        return text, binds

    def _symbol(self, name: str) -> str:
        if name.startswith("z") and name[1:].isdigit():
            return self.language.item("z", int(name[1:]) - 1)
        return self.language.own + name if name in self.names else name

    def _operation(self, name: str, operands: list[tuple[str, int]]) -> tuple[str, int]:
        if name == "neg":
            return f"-{_within(operands[0], _NEGATIVE)}", _NEGATIVE
        if name not in _INFIX:
            texts = [text for text, _ in operands]
            if name == "select" and self.language.choice:
                return self.language.choice.format(*texts), _ATOM
            return f"{self.language.functions[name]}({', '.join(texts)})", _ATOM
        binds, sign = _INFIX[name]
        sign = self.language.signs.get(name, sign)
        if name == "pow":
            base, exponent = (_within(operand, _ATOM) for operand in operands)
            return f"{base}{sign}{exponent.removesuffix('.0')}", _POWER
        least = _ATOM if name in _LOGIC else binds
        left, right = _within(operands[0], least), _within(operands[1], least + (name not in _LOGIC))
        return f"{left} {sign} {right}", binds


def _within(operand: tuple[str, int], least: int) -> str:
    """An operand, in brackets unless it binds at least so tightly."""
    text, binds = operand
    return text if binds >= least else f"({text})"


def opening_of(equations: Equations, by: str) -> list[str]:
    """What a text says of itself, by line; `by` names the programs that can run it."""
    dof, hidden = equations.dof, equations.hidden
    memory = f" and {hidden} hidden state{'s' * (hidden > 1)}" if hidden else ""
    words = (
        "M a + forces of the terms = force, in the units of the numbers: N, m, s, kg. q, v and a are displacement, "
        "velocity and acceleration; a term at i-j resists d = q_j - q_i and w = v_j - v_i, 0 is ground."
    )
    lines = [
        f"Equation of motion of {dof} degree{'s' * (dof > 1)} of freedom{memory}, written by jfsm for {by}.",
        "",
        *textwrap.wrap(words, _WIDTH),
    ]
    for note in equations.notes:
        lines += ["", *textwrap.wrap(f"Note: {note}", _WIDTH)]
    return lines


def numbers_of(equations: Equations, language: Language, before: str = "") -> list[str]:
    """A line for each number, with its unit and meaning."""
    rows = [
        (n.name, n.value, n.parameter.unit(), n.parameter.meaning) for term in equations.terms for n in term.numbers
    ]
    if equations.stick_speed is not None:
        rows.append((STICK_SPEED, equations.stick_speed, "m/s", "friction is smooth below it"))
    found = []
    for name, value, unit, meaning in rows:
        words = ", ".join(word for word in (unit, meaning) if word not in ("", "1")) or "without a unit"
        found.append(f"{before}{name} = {language.number(value)}{language.end}  {language.comment} {words}")
    return found


def _motion(lines: Lines, term: TermEquations, roots: Iterable[Expression]) -> None:
    """Lines for the motion of a term's link, where it asks for it."""
    asked = set[str]().union(*(root.symbols() for root in roots))
    for name, of in (("d", "q"), ("w", "v")):
        if name in asked:
            lines.set(name, lines.language.relative(of, term.at))


def forces_of(equations: Equations, language: Language, total: str, rate: str) -> list[str]:
    """Lines that add the force of every term to `total`, and set the rates of the hidden states."""
    names = {n.name for term in equations.terms for n in term.numbers} | {STICK_SPEED}
    lines = Lines(language, names)
    for term in equations.terms:
        lines.comment(f"{term.title}: {term.what}" if term.what else term.title)
        roots = (term.force, *term.rates)
        _motion(lines, term, roots)
        force, *rates = lines.formulas(roots)
        lines.set("f", force)
        for end, sign in zip(term.at, "-+", strict=True):
            if end:
                where = language.item(total, end - 1)
                lines.set(where, f"{where} {sign} f")
        for i, text in enumerate(rates):
            lines.set(language.item(rate, term.first + i), text)
    return lines.lines


def relaxed_of(equations: Equations, language: Language, states: str) -> list[str]:
    """Lines that set the hidden states that are relaxed at displacement q and velocity v, where they are not zero."""
    names = {n.name for term in equations.terms for n in term.numbers}
    lines = Lines(language, names)
    for term in equations.terms:
        asked = [e for e in term.relaxed if not (e.is_number and e.value == 0)]
        _motion(lines, term, asked)
        formulas = iter(lines.formulas(asked))
        for i, each in enumerate(term.relaxed):
            if each in asked:
                lines.set(language.item(states, term.first + i), next(formulas))
    return lines.lines
