"""The library for Conan 2, without the loader of robot files: MuJoCo is no package of Conan's.

conan create scripts/packages/conan --build=missing
"""

import re
from pathlib import Path

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load


class Kalmarm(ConanFile):
    name = "kalmarm"
    description = "Robot dynamics by the Kalman filter, with the error of every acceleration"
    topics = ("robotics", "dynamics", "kalman-filter")
    license = "Apache-2.0"
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False]}
    default_options = {"shared": False, "fPIC": True}
    implements = ["auto_shared_fpic"]

    def set_version(self):
        header = load(self, self._root("algorithms/include/kalmarm/version.hpp"))
        self.version = re.search('KALMARM_VERSION "(.+)"', header)[1]

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "package.xml", "algorithms/*", "scripts/cmake/*"):
            copy(self, pattern, self._root(), self.export_sources_folder)

    def requirements(self):
        self.requires("eigen/[>=3.4 <6]", visible=False)  # no Eigen type crosses the boundary

    def validate(self):
        check_min_cppstd(self, 20)
        if self.settings.os != "Linux":
            raise ConanInvalidConfiguration("kalmarm is tested on Linux alone")

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["KALMARM_STUDY"] = False
        toolchain.cache_variables["KALMARM_ROBOTS"] = False
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, Path(self.package_folder, "licenses"))
        CMake(self).install()

    def package_info(self):
        self.cpp_info.libs = ["kalmarm"]
        self.cpp_info.system_libs = ["m", "pthread"]
        self.cpp_info.set_property("cmake_find_mode", "none")  # its own files are in the package
        self.cpp_info.builddirs = ["lib/cmake/kalmarm"]

    def _root(self, *names):
        return str(Path(self.recipe_folder, "../../..", *names).resolve())
