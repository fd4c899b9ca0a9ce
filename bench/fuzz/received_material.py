"""Recordings, pictures, a history and weights that trials damage."""

from __future__ import annotations

import json
import pickle
import struct
from pathlib import Path

import numpy as np
import polars as pl

from tests.formats.tracks.test_scenario_descriptions import waymo_scenario
from tests.formats.tracks.test_track_readers import (
    COMMONROAD,
    HIGHD,
    IND,
    INTERACTION,
    NGSIM,
    PEDESTRIANS,
    truth,
)
from tests.formats.tracks.test_tracks_on_maps import crossing_traffic

STEPS = 3
"""One of so many rows of the traffic on the crossing is kept, as long files are slow to damage."""


def write_received(root: Path) -> str:
    """Make all of it below a folder; as a question, nothing is wrong with it."""
    _write_recordings(root / "recordings")
    _write_pictures(root / "pictures")
    _write_history(root / "history.jsonl")
    _write_weights(root / "weights")
    return ""


def _write_recordings(root: Path) -> None:
    lights = "RawFrameID,timestamp(ms),light 1\n0,0,1\n10,1000,3\n20,2000,0\n"
    sind = "track_id,timestamp_ms,agent_type,x,y,vx,vy,ax,ay,yaw_rad,length,width\n" + "".join(
        f"{car},{100 * n},car,{n + 10 * car},{-3.25},10,0,0,0,0,4,1.8\n"
        for car in (1, 2)
        for n in range(20)
    )
    walkers = "track_id,timestamp_ms,agent_type,x,y,vx,vy,ax,ay\n" + "".join(
        f"P1,{100 * n},pedestrian,5,{4 - 0.3 * n},0,-3,0,0\n" for n in range(20)
    )
    texts = {
        "highd": HIGHD,
        "ind": IND,
        "interaction": {
            "vehicle_tracks_000.csv": INTERACTION,
            "pedestrian_tracks_000.csv": PEDESTRIANS,
        },
        "ngsim": {"trajectories.csv": NGSIM},
        "sind": {
            "Veh_smoothed_tracks.csv": sind,
            "Ped_smoothed_tracks.csv": walkers,
            "Traffic_Lights.csv": lights,
        },
        "commonroad": {"scene.xml": COMMONROAD},
    }
    rows = crossing_traffic().gather_every(STEPS)
    texts["tracks"] = {"crossing.csv": rows.write_csv()}
    texts["on the crossing"] = _as_ind(rows)
    for schema, files in texts.items():
        (root / schema).mkdir(parents=True)
        for name, text in files.items():
            (root / schema / name).write_text(text, encoding="utf-8")
    for schema in ("parquet", "argoverse", "osi", "mcap", "scenarionet"):
        (root / schema).mkdir()
    for protocol in (2, 4, 5):
        content = pickle.dumps(waymo_scenario(), protocol=protocol)
        (root / "scenarionet" / f"sd_waymo_{protocol}.pkl").write_bytes(content)
    rows.write_parquet(root / "parquet" / "crossing.parquet")
    rows.select(
        pl.col("id").alias("track_id"),
        ((pl.col("time") - 10.0) * 10.0).round().cast(pl.Int64).alias("timestep"),
        pl.lit("vehicle").alias("object_type"),
        pl.lit(3).alias("object_category"),
        pl.col("x").alias("position_x"),
        pl.col("y").alias("position_y"),
        heading=0.0,
        velocity_x=8.0,
        velocity_y=0.0,
    ).unique(("track_id", "timestep"), maintain_order=True).write_parquet(
        root / "argoverse" / "scenario.parquet"
    )
    messages = [truth(second, 10.0 * second) for second in range(1, 9)]
    framed = b"".join(struct.pack("<I", len(message)) + message for message in messages)
    (root / "osi" / "trace.osi").write_bytes(framed)
    _write_mcap(root / "mcap" / "trace.mcap", messages)


def _as_ind(rows: pl.DataFrame) -> dict[str, str]:
    """The traffic on the crossing as inD has it."""
    names = {name: n for n, name in enumerate(rows["id"].unique(maintain_order=True))}
    tracks = rows.select(
        pl.col("id").replace_strict(names).alias("trackId"),
        ((pl.col("time") - 10.0) / 0.04).round().cast(pl.Int64).alias("frame"),
        pl.col("x").alias("xCenter"),
        pl.col("y").alias("yCenter"),
        heading=0.0,
        width=pl.col("width"),
        length=pl.col("length"),
        xVelocity=8.0,
        yVelocity=0.0,
        xAcceleration=0.0,
        yAcceleration=0.0,
    )
    kinds = {name: rows.filter(pl.col("id") == name)["kind"][0] for name in names}
    meta = "".join(f"{n},{kinds[name]},1.8,4.5\n" for name, n in names.items())
    return {
        "01_recordingMeta.csv": "recordingId,locationId,frameRate\n1,4,25.0\n",
        "01_tracksMeta.csv": f"trackId,class,width,length\n{meta}",
        "01_tracks.csv": tracks.write_csv(),
    }


def _write_mcap(file: Path, messages: list[bytes]) -> None:
    from mcap.writer import CompressionType, Writer

    with file.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        schema = writer.register_schema("osi3.GroundTruth", "protobuf", b"")
        channel = writer.register_channel("ground_truth", "protobuf", schema)
        for second, message in enumerate(messages, 1):
            writer.add_message(channel, second, message, second)
        writer.finish()


def _write_pictures(folder: Path) -> None:
    """A PNG, a JPEG, a TIFF and a GeoTIFF of 60 x 40 pixels, each with a world file."""
    from PIL import Image, TiffImagePlugin

    folder.mkdir()
    colours = np.random.default_rng(1).integers(0, 255, (40, 60, 3), dtype=np.uint8)
    image = Image.fromarray(colours)
    for name, options in (
        ("photo.png", {}),
        ("photo.jpg", {}),
        ("plan.tif", {"compression": "tiff_lzw"}),
    ):
        stem = Path(name).stem + Path(name).suffix[1:]
        image.save(folder / f"{stem}{Path(name).suffix}", **options)
        (folder / f"{stem}.wld").write_text("2\n0\n0\n-2\n-60\n40\n")
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    for tag, values in ((33550, (2.0, 2.0, 0.0)), (33922, (0.0, 0.0, 0.0, -60.0, 40.0, 0.0))):
        tags.tagtype[tag] = 12
        tags[tag] = values
    tags.tagtype[34735] = 3
    tags[34735] = (1, 1, 0, 1, 1025, 0, 1, 1)
    image.save(folder / "geo.tif", tiffinfo=tags, compression="tiff_deflate")
    (folder / "geo.wld").write_text("2\n0\n0\n-2\n-60\n40\n")


def _write_history(file: Path) -> None:
    lines = [
        {
            "format": "odscen-history",
            "version": 1,
            "suite": "city",
            "commit": f"{commit:040x}",
            "date": f"2026-11-{commit + 1:02}T12:00:00+01:00",
            "cases": {
                name: {
                    "status": "passed",
                    "seeds": [1, 2],
                    "figures": {"mean_delay": delay, "arrived": 0.98, "of_mine": 3.0},
                }
                for name in ("rush", "night")
            },
        }
        for commit, delay in enumerate((12.0, 12.1, 18.5, 18.4, 9.0, 9.0))
    ]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


def _write_weights(folder: Path) -> None:
    from odscen.learning.behaviour.imitation_driver import shipped_weights
    from odscen.learning.behaviour.signal_agent import FEATURES, SignalAgent
    from odscen.learning.reference.traffic_model import TrafficModel, model_bytes, new_network

    rng = np.random.default_rng(2)
    folder.mkdir()
    (folder / "driver.npz").write_bytes(shipped_weights())
    agent = SignalAgent(new_network(len(FEATURES), 32, 1, rng), {"seed": 2})
    (folder / "lights.npz").write_bytes(agent.to_bytes())
    from odscen.learning.reference import traffic_model
    from odscen.learning.reference.model_training import binned_statistics

    contexts = np.ones((traffic_model._CONTEXTS, len(traffic_model.VEHICLES)))
    occupied, speed = new_network(8, 32, 1, rng), new_network(14, 32, traffic_model.CLASSES, rng)
    model = TrafficModel(occupied, speed, contexts, {"maps": ["a"]}, binned_statistics(()))
    (folder / "traffic.npz").write_bytes(model_bytes(model))
