"""Formats of robots: ROS 2 bags, LeRobot, rerun.

Nothing below names it but the command line.
"""
