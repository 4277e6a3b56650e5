# SPDX-License-Identifier: Apache-2.0
from xml.etree import ElementTree as ET

from setuptools import find_packages, setup

PACKAGE = "uncom_sim"
MANIFEST = ET.parse("package.xml").getroot()  # colcon runs this file in its folder

setup(
    name=PACKAGE,
    version=MANIFEST.findtext("version"),
    packages=find_packages(exclude=["test"]),
    package_data={PACKAGE: ["py.typed", "**/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    # test/dependencies.yaml says which of these have a rosdep key, and so stand in package.xml too.
    install_requires=[
        "setuptools",
        "distributed",
        "espeakng-loader",
        "example-robot-data",
        "jinja2",
        "manifold3d",
        "matplotlib",
        "numpy",
        "ompl",
        "opencv-python-headless",
        "pillow",
        "pin",
        "psutil",
        "pybullet",
        "pyyaml",
        "rich",
        "scikit-image",
        "scipy",
        "shapely",
        "soxr",
        "trimesh",
    ],
    zip_safe=False,
    maintainer=MANIFEST.findtext("maintainer"),
    maintainer_email=MANIFEST.find("maintainer").get("email"),
    description=MANIFEST.findtext("description"),
    license=MANIFEST.findtext("license"),
    extras_require={
        "peers": ["mplib", "roboplan-core", "roboplan-rrt", "roboplan-simple-ik"],
        "test": ["av", "coal", "mediapipe", "pocketsphinx", "pytest", "pytest-timeout", "rapidfuzz", "soundfile"],
    },
    entry_points={
        "console_scripts": [
            "driver_node = uncom_sim.driver_node:main",
        ],
    },
)
