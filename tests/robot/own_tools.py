"""Tools of somebody's own, as text: boxes and frames on a link called `base`."""


def box(size, p, name="box", kinds=("collision", "visual")):
    """A shape to touch and to see: sides and middle, m."""
    x, y, z = size
    shape = f"<pose>{p[0]} {p[1]} {p[2]} 0 0 0</pose><geometry><box><size>{x} {y} {z}</size></box></geometry>"
    return "".join(f'<{kind} name="{name}">{shape}</{kind}>' for kind in kinds)


def frame(name, pose):
    return f'<frame name="{name}" attached_to="base"><pose>{" ".join(map(str, pose))}</pose></frame>'


TIP = frame("tip", (0, 0, 0.2, 0, 0, 0))
CAMERA = frame("camera", (0.1, 0, -0.05, 0, 0, 1.5707963267948966))
STICK = box((0.012, 0.026, 0.2), (0, 0, 0.1))


def sdf(shapes=STICK, frames=TIP + CAMERA, more="", link="base"):
    """A tool 20 cm long, 12 mm thick and 26 mm wide, unless it is told otherwise."""
    return (
        f'<sdf version="1.9"><model name="own"><link name="{link}"><inertial><mass>0.3</mass>'
        "<pose>0 0 0.1 0 0 0</pose><inertia><ixx>1e-3</ixx><iyy>1e-3</iyy><izz>1e-4</izz></inertia></inertial>"
        f"{shapes}</link>{frames}{more}</model></sdf>"
    )


def link(name):
    return (
        f'<link name="{name}"><inertial><mass>0.1</mass><inertia><ixx>1e-4</ixx><iyy>1e-4</iyy><izz>1e-4</izz>'
        "</inertia></inertial></link>"
    )


def joint(kind, parent, child, name="hinge"):
    axis = "" if kind == "fixed" else "<axis><xyz>0 0 1</xyz></axis>"
    return f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>{axis}</joint>'


URDF = """<robot name="own">
  <link name="base">
    <inertial><mass value="0.3"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.012 0.026 0.2"/></geometry></collision>
    <visual><origin xyz="0 0 0.1"/><geometry><box size="0.012 0.026 0.2"/></geometry></visual>
  </link>
  <link name="tip"/>
  <joint name="to_tip" type="fixed"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.2"/></joint>
</robot>"""
"""The same in URDF, where a frame is a link; it has no camera."""
