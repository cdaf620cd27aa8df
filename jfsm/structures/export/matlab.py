"""The equation of motion as a function file of MATLAB."""

from .equations import Equations
from .writing import Language, forces_of, numbers_of, opening_of, relaxed_of

_SAME = (
    "abs sign max min floor ceil exp log sqrt sin cos tan asin acos atan atan2 sinh cosh tanh expm1 log1p not"
).split()
_MATLAB = Language(
    functions={name: name for name in _SAME} | {"select": "where"},
    signs={"pow": "^", "ne": "~="},
    constants={True: "true", False: "false", float("inf"): "Inf", float("-inf"): "-Inf"},
    comment="%",
    end=";",
    first=1,
    brackets="()",
    own="p.",
)

_FILE = """function dy = {name}(t, y, force, p)
% {upper} {opening}
%
% dy = {name}(t, y, force) is the rate of y = [q; v{z}] ({rows} rows), for ode45 or ode15s; force is a function of t
% that gives {dof} row{s} [N]. y0 = {name}(q, v) is the y to start from{relaxed_words}. For example, with a column
% of time and {columns} of u:
%
%   drive = @(t) interp1(time, u, t, 'spline').';
%   y0 = {name}(zeros({dof}, 1), zeros({dof}, 1));
%   [time, y] = {solver}(@(t, y) {name}(t, y, drive), time, y0, odeset('RelTol', 1e-8, 'AbsTol', 1e-12));
%
% p = {name}() are the numbers; changed, they go in as the fourth argument.

if nargin < 4
    p = numbers();
end
if nargin == 0
    dy = p;
    return
end
if nargin == 2
    q = t(:);
    v = y(:);
    z = zeros({hidden}, 1);{relaxed}
    dy = [q; v; z];
    return
end
q = y(1:{dof});
v = y({v_first}:{v_last});
z = y({z_first}:{rows});
total = zeros({dof}, 1);
rate = zeros({hidden}, 1);

{forces}

drive = force(t);
dy = [v; p.mass \\ (drive(:) - total); rate];
end

function p = numbers()
p.mass = [{mass}];  % kg
{numbers}
end

function y = where(condition, yes, no)
if condition
    y = yes;
else
    y = no;
end
end
"""


def matlab_text(equations: Equations, name: str) -> str:
    """The file of a function of that name."""
    dof, hidden = equations.dof, equations.hidden
    return _FILE.format(
        name=name,
        upper=name.upper(),
        opening="\n% ".join(opening_of(equations, "MATLAB")).replace("% \n", "%\n"),
        z="; z" if hidden else "",
        dof=dof,
        s="s" if dof > 1 else "",
        hidden=hidden,
        columns="a column for each degree of freedom" if dof > 1 else "a column",
        rows=2 * dof + hidden,
        v_first=dof + 1,
        v_last=2 * dof,
        z_first=2 * dof + 1,
        relaxed_words=", hidden states relaxed" if hidden else "",
        solver="ode45" if equations.bounded or equations.stick_speed is None else "ode15s",
        relaxed="".join(f"\n    {line}" for line in relaxed_of(equations, _MATLAB, "z")),
        forces="\n".join(forces_of(equations, _MATLAB, "total", "rate")),
        mass=_MATLAB.matrix(equations.mass),
        numbers="\n".join(numbers_of(equations, _MATLAB, "p.")),
    )
