"""Small folders in the layouts of arms, of plain pictures: what readers of them are told."""

import cv2
import numpy as np

FPS = 100.0


def write_images(folder, name, n=6):
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(n):
        cv2.imwrite(str(folder / name.format(number)), np.full((4, 6), 10 * number, np.uint8))


def write_lines(path, *lines):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
    return path


def write_streams(root):
    """Two streams of felt and silk, a still, and the image at rest."""
    stills = root / "tactile_images"
    for sample in ("1", "2"):
        write_images(stills / sample, "{:04}.png")
        rows = [f"{n:04}.png,{1.7e9 + n / FPS},{n / FPS}" for n in range(6)]
        write_lines(stills / sample / "timestamps.csv", "image,real_time,real_elapsed", *rows)
    write_images(stills, "{}.png", 4)
    rows = ["0.png,reference,0,0", "1.png,felt,1.5,2", "2.png,silk,1.5,3", "3.png,silk,1.5,4"]
    write_lines(root / "targets.csv", "tactile_images,class,pose_z,shear_x", *rows)
    return root


def write_runs(root, runs=3):
    """A press, and runs at 20 and 40 mm/s whose poses say so, too."""
    for run in range(runs):
        folder, began_s = root / f"run_{run}", 100.0 * run
        write_images(folder / "time_series_images", "image_{}.png")
        rows = [f"{n},{began_s + n / FPS},run_{run}/image_{n}.png" for n in range(6)]
        write_lines(folder / "image_data.csv", "frame_id,timestamp,time_series_images", *rows)
        pose = [f"{began_s + n / FPS},{20 * run * n / FPS / 1000},0,0,0,0,0" for n in range(9)]
        columns = ",".join(f"actual_TCP_pose_{n}" for n in range(6))
        write_lines(folder / "robot_data.csv", f"timestamp,{columns}", *pose)
        force = [f"{began_s + n / FPS},0,0,{n}" for n in range(9)]
        write_lines(folder / "ft_sensor_data.csv", "timestamp,force_x,force_y,force_z", *force)
        if run:
            events = [f"{began_s + 0.01},start", f"{began_s + 0.04},end"]
            write_lines(folder / "control_data.csv", "timestamp,event", *events)
    rows = [f"{run},cloth_{run % 2},{20 * run}" for run in range(runs)]
    write_lines(root / "targets.csv", "sample,class,linear_speed", *rows)
    return root
