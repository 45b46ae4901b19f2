"""Definitions of the ROS 2 messages in a log, as an MCAP file carries them (ros2msg, as of ROS 2 Humble)."""

from __future__ import annotations

#: fields of every type, constants left out
TYPES = {
    "sensor_msgs/JointState": """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
""",
    "tf2_msgs/TFMessage": """\
geometry_msgs/TransformStamped[] transforms
""",
    "visualization_msgs/MarkerArray": """\
visualization_msgs/Marker[] markers
""",
    "std_msgs/Header": """\
builtin_interfaces/Time stamp
string frame_id
""",
    "builtin_interfaces/Time": """\
int32 sec
uint32 nanosec
""",
    "builtin_interfaces/Duration": """\
int32 sec
uint32 nanosec
""",
    "geometry_msgs/TransformStamped": """\
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
""",
    "geometry_msgs/Transform": """\
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
""",
    "geometry_msgs/Vector3": """\
float64 x
float64 y
float64 z
""",
    "geometry_msgs/Point": """\
float64 x
float64 y
float64 z
""",
    "geometry_msgs/Quaternion": """\
float64 x
float64 y
float64 z
float64 w
""",
    "geometry_msgs/Pose": """\
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
""",
    "std_msgs/ColorRGBA": """\
float32 r
float32 g
float32 b
float32 a
""",
    "sensor_msgs/CompressedImage": """\
std_msgs/Header header
string format
uint8[] data
""",
    "visualization_msgs/UVCoordinate": """\
float32 u
float32 v
""",
    "visualization_msgs/MeshFile": """\
string filename
uint8[] data
""",
    "visualization_msgs/Marker": """\
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
visualization_msgs/UVCoordinate[] uv_coordinates
string text
string mesh_resource
visualization_msgs/MeshFile mesh_file
bool mesh_use_embedded_materials
""",
}


def definition(name: str) -> str:
    """The text of a type ("sensor_msgs/JointState"), and after it those of all types that it is made of."""
    used = [name]
    for kind in used:
        words = [line.split()[0].removesuffix("[]") for line in TYPES[kind].splitlines()]
        used += [word for word in dict.fromkeys(words) if word in TYPES and word not in used]
    parts = [TYPES[name], *(f"MSG: {kind}\n{TYPES[kind]}" for kind in used[1:])]
    return ("=" * 80 + "\n").join(parts)
