"""A recording of strapd in Rerun: body axes in the world, rates, specific forces.

    pip install rerun-sdk
    python packaging/layouts/rerun_view.py attitude.mcap                   # opens the viewer
    python packaging/layouts/rerun_view.py attitude.mcap -o attitude.rrd   # a file to open later, layout and all
"""

import argparse

import rerun as rr
import rerun.blueprint as rrb


def layout(topic: str, world: str) -> rrb.Blueprint:
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                name="Attitude",
                origin="/",
                contents=["/tf", topic],
                spatial_information=rrb.SpatialInformation(target_frame=world),
            ),
            rrb.TimeSeriesView(name="Body rate, rad/s; specific force, m/s^2", origin=topic),
            column_shares=[2, 3],
        ),
        collapse_panels=True,
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("mcap")
    arguments.add_argument("-o", "--output", help="write an .rrd, do not open the viewer")
    arguments.add_argument("--topic", default="/imu/data/attitude")
    arguments.add_argument("--world", default="world", help="frame the attitude is shown in")
    given = arguments.parse_args()
    blueprint = layout(given.topic, given.world)
    rr.init("strapd", spawn=False)
    if given.output:
        rr.save(given.output, default_blueprint=blueprint)
    else:
        rr.spawn(default_blueprint=blueprint)
    # Rerun reads sensor_msgs/msg/Imu and /tf by itself; the axes are drawn where the body's frame is.
    rr.log_file_from_path(given.mcap)
    rr.log(given.topic, rr.TransformAxes3D(1.0), static=True)
    rr.disconnect()


if __name__ == "__main__":
    main()
