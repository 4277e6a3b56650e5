# SPDX-License-Identifier: Apache-2.0
from xml.etree import ElementTree as ET

from setuptools import find_packages, setup

PACKAGE = "uncom_tiago_exec"
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
        "coal",
        "numpy",
        "ompl",
        "opencv-python-headless",
        "pin",
        "py-trees",
        "ruckig",
        "scipy",
        "shapely",
    ],
    zip_safe=False,
    maintainer=MANIFEST.findtext("maintainer"),
    maintainer_email=MANIFEST.find("maintainer").get("email"),
    description=MANIFEST.findtext("description"),
    license=MANIFEST.findtext("license"),
    extras_require={"test": ["hypothesis", "pytest", "pytest-timeout"]},
    entry_points={
        "console_scripts": [
            "execution_node = uncom_tiago_exec.execution_node:main",
        ],
    },
)
