"""ROS recordings, written by rosbags."""

import numpy as np
import pytest

from jfsm.records import read

N = 50
BEGIN = 1_593_335_798_138_876_361


@pytest.fixture(params=["bag", "mcap", "db3"])
def recording(request, tmp_path):
    """An IMU whose messages reach the recorder late by 3 ms and more, and a force without a stamp of the sensor."""
    typesys = pytest.importorskip("rosbags.typesys")
    ros1 = request.param == "bag"
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if ros1 else typesys.Stores.ROS2_HUMBLE)
    types = store.types
    vector = types["geometry_msgs/msg/Vector3"]
    if ros1:
        from rosbags.rosbag1 import Writer

        path = tmp_path / "a.bag"
        writer = Writer(path)
    else:
        from rosbags.rosbag2 import StoragePlugin, Writer

        plugin = StoragePlugin.MCAP if request.param == "mcap" else StoragePlugin.SQLITE3
        writer = Writer(tmp_path / "a", version=9, storage_plugin=plugin)

    def pack(message, kind):
        return store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)

    with writer:
        imu = writer.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
        load = writer.add_connection("/load", "geometry_msgs/msg/Vector3", typestore=store)
        for i in range(N):
            at = BEGIN + 2_500_000 * i
            stamp = types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9)
            header = types["std_msgs/msg/Header"](*((i,) if ros1 else ()), stamp=stamp, frame_id="imu")
            message = types["sensor_msgs/msg/Imu"](
                header=header,
                orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
                orientation_covariance=np.zeros(9),
                angular_velocity=vector(0.0, 0.0, 0.1 * i),
                angular_velocity_covariance=np.zeros(9),
                linear_acceleration=vector(0.5 * i, 0.0, 9.8),
                linear_acceleration_covariance=np.zeros(9),
            )
            writer.write(imu, at + 3_000_000 + 1000 * (i % 7), pack(message, "sensor_msgs/msg/Imu"))
            writer.write(load, at, pack(vector(float(i), 0.0, 0.0), "geometry_msgs/msg/Vector3"))
    if not ros1:
        path = next((tmp_path / "a").glob(f"*.{request.param}"))
    return path


def test_numbers_of_a_topic_have_the_clock_of_the_sensor(recording):
    record = read(recording, acceleration="/imu.linear_acceleration.x")
    np.testing.assert_allclose(record.time, 2.5e-3 * np.arange(N), atol=1e-9)
    np.testing.assert_array_equal(record.channels["acceleration", 1], 0.5 * np.arange(N))
    assert any("of the sensors (header.stamp) on /imu" in note for note in record.notes)
    assert any("of the recorder on /load" in note for note in record.notes)
    assert any("reads zero at 2020-06-28 09:16:38.138876361" in note for note in record.notes)
    turning = read(recording, velocity="/imu.angular_velocity.z")
    assert turning.units["velocity"] == "rad/s"
    np.testing.assert_array_equal(read(recording, force="/load.x").channels["force", 1], np.arange(N))


def test_a_recording_that_is_cut_short_is_refused(recording):
    recording.write_bytes(recording.read_bytes()[:300])
    with pytest.raises(ValueError, match=r"must be a ROS recording with message definitions; .*Copy it again"):
        read(recording, force="/load.x")


def test_a_recording_of_another_ending_is_named(tmp_path):
    pytest.importorskip("rosbags.highlevel")
    (tmp_path / "a.dat").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    with pytest.raises(ValueError, match=r"a\.dat is a ROS recording, which must end in \.bag\. Rename it"):
        read(tmp_path / "a.dat", force="F")
