"""Formats of robots: ROS 2 bags, LeRobot, rerun; only the command line names it."""
