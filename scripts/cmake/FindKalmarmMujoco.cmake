# MuJoCo 3.10 or later as target mujoco::mujoco, its version as KalmarmMujoco_VERSION. An installed release is preferred
# if it is new enough, else the wheel that scripts/setup puts into build/venv. With KalmarmMujoco_WHEEL, a wheel's folder
# `mujoco`, that one and no other.

set(required 3.10)
if(NOT KalmarmMujoco_WHEEL)
  find_package(mujoco ${required} CONFIG QUIET)
endif()
if(mujoco_FOUND)
  set(KalmarmMujoco_LIBRARY mujoco::mujoco)
  set(KalmarmMujoco_VERSION ${mujoco_VERSION})
else()
  # The wheel's library carries its version in its name, with no link beside it that does not.
  if(NOT KalmarmMujoco_WHEEL)
    set(KalmarmMujoco_WHEEL "${CMAKE_CURRENT_LIST_DIR}/../../build/venv/lib/python3*/site-packages/mujoco")
  endif()
  file(GLOB KalmarmMujoco_LIBRARY "${KalmarmMujoco_WHEEL}/libmujoco.so.*")
  if(KalmarmMujoco_LIBRARY)
    cmake_path(NORMAL_PATH KalmarmMujoco_LIBRARY)
    cmake_path(GET KalmarmMujoco_LIBRARY PARENT_PATH wheel)
    file(STRINGS "${wheel}/include/mujoco/mujoco.h" version REGEX "#define mjVERSION_HEADER")
    string(REGEX MATCH "[0-9]+" version "${version}")
    # major * 1000000 + minor * 1000 + patch, from 3.10 on
    math(EXPR major "${version} / 1000000")
    math(EXPR minor "${version} / 1000 % 1000")
    math(EXPR patch "${version} % 1000")
    set(KalmarmMujoco_VERSION ${major}.${minor}.${patch})
    if(KalmarmMujoco_VERSION VERSION_LESS required)
      message(FATAL_ERROR "MuJoCo in ${wheel} is ${KalmarmMujoco_VERSION}, Kalmarm needs ${required} or later: "
                          "run scripts/setup, which installs it")
    endif()
  endif()
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  KalmarmMujoco
  REQUIRED_VARS KalmarmMujoco_LIBRARY
  VERSION_VAR KalmarmMujoco_VERSION
  REASON_FAILURE_MESSAGE "run scripts/setup, which installs it")

if(KalmarmMujoco_FOUND AND NOT TARGET mujoco::mujoco)
  add_library(mujoco::mujoco SHARED IMPORTED)
  set_target_properties(
    mujoco::mujoco PROPERTIES IMPORTED_LOCATION "${KalmarmMujoco_LIBRARY}"
                              INTERFACE_INCLUDE_DIRECTORIES "${wheel}/include")
endif()
