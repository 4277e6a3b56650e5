# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

PACKAGE = "uncom_common"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    package_data={PACKAGE: ["py.typed", "**/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    maintainer="UNCOM maintainers",
    maintainer_email="uncom@example.com",
    description="What the nodes share: configuration, time, transforms, camera geometry.",
    license="Apache-2.0",
    extras_require={"test": ["pytest"]},
)
