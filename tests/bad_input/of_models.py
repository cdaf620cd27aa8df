"""Structures that cannot be, and files that hold none."""

# pyright: reportArgumentType=false, reportCallIssue=false
# Wrong types are what is tried.

import copy
import pickle

import numpy as np

import jfsm

from .rows import NAN, Row, Stage, refused, right


def _spring(k: object = 1.0, at: object = (0, 1)) -> jfsm.LinearStiffness:
    return jfsm.LinearStiffness(k, at=at)  # pyright: ignore[reportArgumentType]


def _s(**given: object) -> jfsm.Structure:
    return jfsm.Structure(**{"mass": [1.0], "terms": [], **given})  # pyright: ignore[reportArgumentType]


def _load(stage: Stage, content: str | bytes) -> jfsm.Structure:
    return jfsm.Structure.load(stage.file("m.toml", content))


def _toml(name: str, content: str | bytes, says: str) -> Row:
    return refused(name, lambda s: _load(s, content), says)


def _m(stage: Stage) -> jfsm.Structure:
    return stage.model


GOOD = "mass = [1.0]\n"

ROWS: list[Row] = [
    refused("a mass of text", lambda s: _s(mass="1"), r"`mass` must hold real numbers; got dtype <U1", TypeError),
    refused("no mass", lambda s: _s(mass=None), r"`mass` must hold real numbers", TypeError),
    refused("no masses", lambda s: _s(mass=[]), r"`mass` must hold at least one mass, none negative; got \[\]"),
    refused("a negative mass", lambda s: _s(mass=[-1.0]), r"none negative; got \[-1\.0\]"),
    refused("a mass that is NaN", lambda s: _s(mass=[NAN]), r"`mass` must be finite; 1 of 1 .*Remove or fill"),
    refused("terms as text", lambda s: _s(terms="k"), r"`terms` must hold terms such as .*got 'k'", TypeError),
    refused("a number for terms", lambda s: _s(terms=3), r"`terms` must be a list; got 3", TypeError),
    refused("a class for a term", lambda s: _s(terms=[jfsm.LinearStiffness]), r"`terms` must hold terms such as", TypeError),
    right("a term without a list", lambda s: _s(terms=_spring()).terms, lambda terms: len(terms) == 1),
    refused("a term beyond the masses", lambda s: _s(terms=[_spring(at=(0, 2))]), r"`at`=\(0, 2\) of stiffness names a degree of freedom beyond the structure's 1"),
    refused("a term far beyond", lambda s: _s(terms=[_spring(at=(0, 10**12))]), r"beyond the structure's 1"),
    refused("a link of one end", lambda s: _spring(at=(1, 1)), r"`at` must name two different degrees of freedom, 0 for ground; got \(1, 1\)"),
    refused("a place as text", lambda s: _spring(at="01"), r"`at` must be a pair \(i, j\)"),
    refused("a place as a number", lambda s: _spring(at=1), r"`at` must be a pair \(i, j\)"),
    refused("a place below ground", lambda s: _spring(at=(-1, 1)), r"`at` must name two different"),
    refused("a place between masses", lambda s: _spring(at=(0, 1.5)), r"`at` must be a pair"),
    refused("a value as text", lambda s: _spring("1"), r"A parameter must be a real number; got '1'", TypeError),
    refused("two values", lambda s: _spring([1.0, 2.0]), r"A parameter must be one real number; got \[1\.0, 2\.0\]", TypeError),
    refused("a value that is NaN", lambda s: _spring(NAN), r"A parameter must be finite; got nan"),
    refused("chains of unequal length", lambda s: jfsm.Structure.chain([1, 1], [1], [1, 1]), r"`stiffness` must have one value per mass \(2\); got 1"),
    refused("matrices of unequal size", lambda s: jfsm.Structure.from_matrices(np.eye(2), np.eye(3), np.eye(2)), r"`stiffness` must be symmetric and of the size of `mass` \(2, 2\); got shape \(3, 3\)"),
    refused("matrices as text", lambda s: jfsm.Structure.from_matrices("a", "b", "c"), r"`mass` must hold real numbers", TypeError),
    refused("a frequency below zero", lambda s: jfsm.Structure.from_modes([-1.0], [0.1], np.eye(1)), r"`frequencies` and `modal_masses` must not be negative"),
    refused("modes without a shape", lambda s: jfsm.Structure.from_modes([1.0], [0.1, 0.2], np.eye(2)), r"`damping_ratios` must have 1 modes"),
    refused("a value of no name", lambda s: _m(s).with_values({"x": 1}), r"'x' names no parameter of this structure; it has mass@1"),
    refused("a named value as text", lambda s: _m(s).with_values({"mass@1": "3"}), r"`mass@1` must be one number; got '3'", TypeError),
    refused("values without names", lambda s: _m(s).with_values([1]), r"`values` must be numbers by path", TypeError),
    refused("trust as text", lambda s: _m(s).uncertain(stiffness="a"), r"`stiffness` must be one number; got 'a'", TypeError),
    refused("trust below zero", lambda s: _m(s).uncertain(stiffness=-1), r"must be a positive share such as 0\.05; got -1"),
    refused("trust in nothing", lambda s: _m(s).uncertain(foo=0.1), r"`foo` names no parameter"),
    refused("without a text", lambda s: _m(s).without("a"), r"`part` must be one of the structure's own terms or sensors; got 'a'"),
    refused("loaded from a number", lambda s: jfsm.Structure.load(3), r"`path` must be a path, .*it was 3", TypeError),
    refused("saved to a number", lambda s: _m(s).save(3), r"`path` must be a path, .*it was 3", TypeError),
    refused("loaded from nowhere", lambda s: jfsm.Structure.load(s.folder / "no.toml"), r"There is no model file .*no\.toml; write one with", FileNotFoundError),
    refused("loaded from a folder", lambda s: jfsm.Structure.load(s.folder), r"There is no model file", FileNotFoundError),
    _toml("nothing in it", "", r"`mass` is missing; write e\.g\. mass = \[1\.0\]"),
    _toml("no TOML", "3", r"m\.toml is not a TOML file: Expected '='"),
    _toml("a record", "time,F\n0,1\n", r"is not a TOML file"),
    _toml("lists nested deeply", "a=" + "[" * 5000 + "]" * 5000, r"m\.toml is not the TOML file of a model: it is nested too deeply"),
    _toml("tables nested deeply", "a=" + "{a=" * 3000 + "1" + "}" * 3000, r"it is nested too deeply"),
    _toml("a number of 10000 digits", f"mass = [1.0]\nx = {'9' * 10000}", r"m\.toml is not a TOML file"),
    _toml("bytes", "mass = [1.0]\n# ä".encode("latin-1"), r"m\.toml is not a TOML file: 'utf-8' codec"),
    _toml("an unknown entry", GOOD + "color = 3\n", r"unknown entry 'color'; a model has mass, commands, term, sensor, uncertain"),
    _toml("a mass as text", 'mass = ["a"]\n', r"m\.toml: `mass` must hold real numbers"),
    _toml("an unknown kind", GOOD + '[[term]]\nkind = "stifness"\nat = [0, 1]\nk = 1.0\n', r"m\.toml, term 1: `kind` must be one of .*got 'stifness'\. Did you mean stiffness"),
    _toml("a place far away", GOOD + '[[term]]\nkind = "stiffness"\nat = [0, 1000000000000]\nk = 1.0\n', r"beyond the structure's 1"),
    right("a BOM", lambda s: _load(s, "\ufeff" + _m(s).to_toml()), lambda model: model.dof == 1),
    right("a copy", lambda s: (_m(s), copy.copy(_m(s))), lambda pair: pair[0].values() == pair[1].values()),
    right("a deep copy", lambda s: (_m(s), copy.deepcopy(_m(s))), lambda pair: pair[0].values() == pair[1].values()),
    right("a pickle", lambda s: (_m(s), pickle.loads(pickle.dumps(_m(s)))), lambda pair: pair[0].values() == pair[1].values()),
    right("springs of 1e-12 and 1e12", lambda s: jfsm.Structure.chain([1, 1], [1e-12, 1e12], [0, 0]).values(), lambda v: v["stiffness@0-1.k"] == 1e-12),
]  # fmt: skip
