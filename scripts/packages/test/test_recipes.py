"""Recipes of packages: each package manager reads its own, and all are of the library's version. With --build Conan's package
is built, and a program with it."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import rattler_build
from catkin_pkg.package import parse_package

ROOT = Path(__file__).parents[3]
PACKAGES = ROOT / "scripts/packages"
HEADER = (ROOT / "algorithms/include/kalmarm/version.hpp").read_text()
VERSION = re.search('KALMARM_VERSION "(.+)"', HEADER)[1]

# What of a port calls vcpkg's functions: the first configures the sources with the port's options.
FUNCTIONS = """
cmake_minimum_required(VERSION 3.25)
set(PORT kalmarm)
set(CURRENT_PORT_DIR {port})
set(CMAKE_CURRENT_LIST_DIR {port})
set(CURRENT_PACKAGES_DIR {packages})
function(vcpkg_check_features)
  set(features -DKALMARM_ROBOTS=OFF PARENT_SCOPE)
endfunction()
function(vcpkg_cmake_configure)
  cmake_parse_arguments(arg "" "SOURCE_PATH" "OPTIONS" ${{ARGN}})
  execute_process(COMMAND cmake -S ${{arg_SOURCE_PATH}} -B {packages}/build -G Ninja ${{arg_OPTIONS}} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(vcpkg_cmake_install)
endfunction()
function(vcpkg_cmake_config_fixup)
endfunction()
function(vcpkg_fixup_pkgconfig)
endfunction()
function(vcpkg_install_copyright)
  cmake_parse_arguments(arg "" "" "FILE_LIST" ${{ARGN}})
  file(INSTALL ${{arg_FILE_LIST}} DESTINATION {packages}/share/kalmarm RENAME copyright)
endfunction()
include({port}/portfile.cmake)
"""


def conan(*words, home: Path) -> str:
    command = [Path(sys.executable).parent / "conan", *words]
    ran = subprocess.run(
        command, cwd=ROOT, env=dict(os.environ, CONAN_HOME=str(home)), capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


def test_package_of_ros_is_valid_and_of_the_version():
    warnings: list[str] = []
    package = parse_package(ROOT / "package.xml", warnings=warnings)
    package.validate(warnings=warnings)
    assert (package.name, package.version, warnings) == ("kalmarm", VERSION, [])


def test_recipe_of_conda_renders_to_the_version():
    folder = PACKAGES / "conda"
    variants = rattler_build.VariantConfig.from_file(folder / "variants.yaml")
    recipe = rattler_build.Stage0Recipe.from_file(folder / "recipe.yaml")
    (rendered,) = recipe.render(variants)
    assert str(rendered.recipe.package.version) == VERSION
    assert (folder / recipe.to_dict()["source"][0]["path"]).resolve() == ROOT


def test_recipe_of_conan_exports_all_that_is_built(tmp_path):
    exported = conan("export", "scripts/packages/conan", "--format=json", home=tmp_path)
    assert json.loads(exported)["reference"].startswith(f"kalmarm/{VERSION}#")
    (sources,) = tmp_path.glob("p/*/es")
    configured = subprocess.run(
        ["cmake", "-S", sources, "-B", tmp_path / "build", "-G", "Ninja", "-DKALMARM_STUDY=OFF", "-DKALMARM_ROBOTS=OFF"],
        capture_output=True,
        text=True,
    )
    assert configured.returncode == 0, configured.stderr


def test_port_of_vcpkg_configures_the_sources(tmp_path):
    port = PACKAGES / "vcpkg/kalmarm"
    assert json.loads((port / "vcpkg.json").read_text())["version-semver"] == VERSION
    script = tmp_path / "port.cmake"
    script.write_text(FUNCTIONS.format(port=port, packages=tmp_path / "packages"))
    ran = subprocess.run(["cmake", "-P", script], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert {file.name for file in (tmp_path / "packages/share/kalmarm").iterdir()} == {"copyright", "usage"}
    assert "KALMARM_STUDY:BOOL=OFF" in (tmp_path / "packages/build/CMakeCache.txt").read_text()


@pytest.mark.skipif("KALMARM_BUILD_RECIPES" not in os.environ, reason="takes minutes")
def test_package_of_conan_serves_a_program(tmp_path):
    conan("profile", "detect", home=tmp_path)
    profile = tmp_path / "profile"
    profile.write_text(
        "include(default)\n[settings]\ncompiler.cppstd=20\n[conf]\n"
        'tools.build:cxxflags=["-O0"]\ntools.build:jobs=2\n[platform_requires]\neigen/3.4.0\n'
    )
    printed = conan("create", "scripts/packages/conan", f"--profile:all={profile}", home=tmp_path)
    assert "Testing the package" in printed
