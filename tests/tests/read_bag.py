"""Reads a bag by the package `rosbags` and compares it with what it was made of: BAG RUN_FOLDER [TICKS].

TICKS is how many the bag has, if it has fewer than the run."""

import csv
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

bag, run = Path(sys.argv[1]), Path(sys.argv[2])
store = get_typestore(Stores.ROS2_HUMBLE)
SPHERE, CYLINDER, LINE_LIST, ADD, DELETE = 2, 3, 5, 0, 2
STEP_NS = 100_000_000


def read(path):
    """Messages by topic, with their times."""
    found, latest, count = {}, 0, 0
    with Reader(path) as reader:
        for connection in reader.connections:
            found[connection.topic] = []
            # What the bag brings along is what the package knows by this name.
            brought = get_typestore(Stores.EMPTY)
            brought.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            known = store.hash_rihs01(connection.msgtype)
            assert brought.hash_rihs01(connection.msgtype) == known, connection
            assert connection.digest in ("", known), connection
        for connection, time_ns, data in reader.messages():
            assert time_ns >= latest, "in order of time"
            latest, count = time_ns, count + 1
            message = store.deserialize_cdr(data, connection.msgtype)
            # Nothing is left over, and nothing is padded otherwise.
            assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(data), connection.topic
            found[connection.topic].append((time_ns, message))
        assert count == reader.message_count
        for connection in reader.connections:
            assert connection.msgcount == len(found[connection.topic]), connection
        assert (reader.start_time, reader.end_time) == (0, latest + 1)
    return found


def stamp(time_ns):
    return time_ns // 10**9, time_ns % 10**9


def is_at(header, time_ns):
    return (header.stamp.sec, header.stamp.nanosec) == stamp(time_ns) and header.frame_id == "world"


def place(it):
    return it.x, it.y, it.z


def turn(it):
    return it.x, it.y, it.z, it.w


found = read(bag)
# The storage file alone says the same.
alone = read(bag / f"{bag.name}_0.mcap")
assert {topic: len(messages) for topic, messages in alone.items()} == {
    topic: len(messages) for topic, messages in found.items()
}

recorded = {}
with open(run / "run.mcap", "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
        recorded.setdefault(channel.topic, []).append((message.log_time, decoded))
ticks = int(sys.argv[3]) if len(sys.argv) > 3 else len(recorded["/robots"])
end_ns = (ticks - 1) * STEP_NS

# Time: once each tick, and ever later.
times = [(message.clock.sec, message.clock.nanosec) for _, message in found["/clock"]]
assert times == [stamp(tick * STEP_NS) for tick in range(ticks)], times

# Poses and frames: as recorded to the last bit, and as poses.csv to single precision.
robots = len(recorded["/robots"][0][1].poses)
assert len(found["/robots"]) == len(found["/tf"]) == ticks
for (at, poses), (_, frames), (time_ns, before) in zip(found["/robots"], found["/tf"], recorded["/robots"]):
    assert at == time_ns and is_at(poses.header, at)
    assert len(poses.poses) == len(frames.transforms) == robots
    for robot, (pose, frame, was) in enumerate(zip(poses.poses, frames.transforms, before.poses)):
        assert place(pose.position) == place(was.position) and turn(pose.orientation) == turn(was.orientation)
        assert frame.child_frame_id == f"robot_{robot}" and is_at(frame.header, at)
        assert place(frame.transform.translation) == place(was.position)
        assert turn(frame.transform.rotation) == turn(was.orientation)
rows = 0
with open(run / "poses.csv") as file:
    for row in csv.DictReader(file):
        tick, robot = int(row["tick"]), int(row["robot"])
        if tick < ticks:
            pose = found["/robots"][tick][1].poses[robot]
            assert abs(pose.position.x - float(row["x_m"])) < 1e-6, row
            assert abs(pose.position.y - float(row["y_m"])) < 1e-6, row
            rows += 1
assert rows >= robots * ticks, rows

# Shapes: as recorded, and taken back when they are gone.
scenes = [(at, update) for at, update in recorded["/scene"] if at <= end_ns]
assert abs(len(found["/scene"]) - len(scenes)) <= (ticks < len(recorded["/robots"])), (len(found["/scene"]), len(scenes))
latest, taken_back = {}, 0
for (at, markers), (time_ns, update) in zip(found["/scene"], scenes):
    assert at == time_ns
    latest.update({entity.id: entity for entity in update.entities})
    shown = {}
    for marker in markers.markers:
        assert is_at(marker.header, at) and (marker.ns, marker.id) not in shown
        shown[marker.ns, marker.id] = marker
    for name, entity in latest.items():
        solids = [*entity.cylinders, *entity.spheres]
        for number, solid in enumerate(solids):
            marker = shown.pop((name, number))
            assert (marker.type, marker.action) == (CYLINDER if entity.cylinders else SPHERE, ADD)
            assert place(marker.pose.position) == place(solid.pose.position)
            assert place(marker.scale) == place(solid.size)
            assert abs(marker.color.r - solid.color.r) < 1e-6 and marker.color.a == 1
        pairs = []
        for line in entity.lines:
            corners = [place(point) for point in line.points]
            for pair in zip(corners, corners[1:] + corners[:1]):
                pairs += pair
        if pairs:
            marker = shown.pop((name, len(solids)))
            assert (marker.type, marker.action) == (LINE_LIST, ADD)
            assert [place(point) for point in marker.points] == pairs
            assert 0.001 < marker.scale.x < 0.01, marker.scale
            assert turn(marker.pose.orientation) == (0, 0, 0, 1)
    assert all(marker.action == DELETE and not marker.points for marker in shown.values()), shown
    taken_back += len(shown)

# Numbers: as metrics.csv, and none where it has none.
unknown = 0
with open(run / "metrics.csv") as file:
    rows = [row for row in csv.DictReader(file) if int(row["tick"]) < ticks]
for topic, messages in found.items():
    if not topic.startswith("/metrics/"):
        continue
    key = topic.removeprefix("/metrics/")
    column = lambda row: row[key] if key in row else str(int(row[key + "_loss"]) + int(row[key + "_fault"]))
    known = [(int(row["tick"]) * STEP_NS, float(column(row))) for row in rows if column(row)]
    assert [(at, message.data) for at, message in messages] == known, topic
    unknown += len(rows) - len(known)
print(f"{ticks} ticks, {robots} robots, {taken_back} taken back, {unknown} unknown")
