# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "uncom_bringup"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    package_data={PACKAGE: ["py.typed", "**/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", [str(path) for path in Path(PACKAGE, "launch").glob("*.launch.py")]),
        (f"share/{PACKAGE}/config", [str(path) for path in Path(PACKAGE, "config").iterdir()]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    maintainer="UNCOM maintainers",
    maintainer_email="uncom@example.com",
    description="Starting the graph, the command line, bags and the report.",
    license="Apache-2.0",
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": [
            "uncom = uncom_bringup.cli:main",
        ],
    },
)
