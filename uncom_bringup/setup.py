# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from xml.etree import ElementTree as ET

from setuptools import find_packages, setup

PACKAGE = "uncom_bringup"
MANIFEST = ET.parse("package.xml").getroot()  # colcon runs this file in its folder

setup(
    name=PACKAGE,
    version=MANIFEST.findtext("version"),
    packages=find_packages(exclude=["test"]),
    package_data={PACKAGE: ["py.typed", "**/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", [str(path) for path in Path(PACKAGE, "launch").glob("*.launch.py")]),
        (f"share/{PACKAGE}/config", [str(path) for path in Path(PACKAGE, "config").iterdir()]),
    ],
    # test/dependencies.yaml says which of these have a rosdep key, and so stand in package.xml too.
    install_requires=[
        "setuptools",
        "apsw",
        "av",
        "backports.zstd",
        "jinja2",
        "markupsafe",
        "numpy",
        "opencv-python-headless",
        "pillow",
        "psutil",
        "pyyaml",
        "rosbags",
    ],
    zip_safe=False,
    maintainer=MANIFEST.findtext("maintainer"),
    maintainer_email=MANIFEST.find("maintainer").get("email"),
    description=MANIFEST.findtext("description"),
    license=MANIFEST.findtext("license"),
    extras_require={"test": ["pytest", "pytest-timeout"]},
    entry_points={
        "console_scripts": [
            "uncom = uncom_bringup.cli:main",
        ],
    },
)
