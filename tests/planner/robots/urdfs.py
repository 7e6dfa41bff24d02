"""Small URDF documents, valid or broken on purpose."""

from __future__ import annotations

LIMIT = '<limit lower="-1.5" upper="1.5" velocity="2" effort="30"/>'
INERTIAL = (
    '<inertial><origin xyz="0.1 -0.05 0.2" rpy="0.3 -0.2 0.5"/><mass value="3.5"/>'
    '<inertia ixx="0.02" ixy="0.001" ixz="-0.002" iyy="0.03" iyz="0.0015" izz="0.025"/></inertial>'
)


def link(name: str, content: str = "") -> str:
    return f'<link name="{name}">{content}</link>'


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    origin: str = '<origin xyz="0 0 0.3" rpy="0 0 0"/>',
    axis: str = '<axis xyz="0 0 1"/>',
    limit: str = LIMIT,
    more: str = "",
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{origin}{axis}{limit}{more}</joint>'


def robot(*elements: str) -> str:
    return f'<robot name="test">{"".join(elements)}</robot>'


def two_links(inertial: str = "", **changes: str) -> str:
    """Return one joint between two links, with changes."""
    return robot(link("base"), link("tip", inertial), joint("turn", "base", "tip", **changes))


def inertial(mass: str = "1", moments: str = 'ixx="1" iyy="1" izz="1"', origin: str = "") -> str:
    products = 'ixy="0" ixz="0" iyz="0"'
    return f'<inertial>{origin}<mass value="{mass}"/><inertia {moments} {products}/></inertial>'


def chain(count: int, kind: str = "revolute") -> str:
    """Return `count` joints in series."""
    links = [link(f"l{i}") for i in range(count + 1)]
    return robot(*links, *(joint(f"j{i}", f"l{i}", f"l{i + 1}", kind=kind) for i in range(count)))
