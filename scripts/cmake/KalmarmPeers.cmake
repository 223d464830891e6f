# The modules that bench_peers loads (benchmarks/peers/peer.hpp), as KALMARM_PEER_MODULES, a list of targets and paths
# that are to be built before it. Each library that `scripts/setup --peers` has installed gives one; what is header-only
# is built by gcc and by clang.

set(KALMARM_PEER_MODULES)

function(kalmarm_peer_module name source)
  add_library(${name} MODULE ${source})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE Eigen3::Eigen)
  set_target_properties(${name} PROPERTIES
    PREFIX "" LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/peers CXX_VISIBILITY_PRESET hidden)
  list(APPEND KALMARM_PEER_MODULES $<TARGET_FILE:${name}>)
  set(KALMARM_PEER_MODULES ${KALMARM_PEER_MODULES} PARENT_SCOPE)
endfunction()

# With the flags of Debian's builds, since the alignment of Eigen's types and the layout of Simbody's depend on them:
# no -march, no NDEBUG.
function(kalmarm_debian_peer name include)
  foreach(found ${include} ${ARGN})
    if(NOT ${found})
      return()
    endif()
  endforeach()
  kalmarm_peer_module(peer_${name} ${CMAKE_CURRENT_SOURCE_DIR}/peers/${name}.cpp)
  set_target_properties(peer_${name} PROPERTIES COMPILE_OPTIONS "-UNDEBUG;-Wall;-Wextra")
  target_include_directories(peer_${name} SYSTEM PRIVATE ${${include}})
  foreach(library ${ARGN})
    target_link_libraries(peer_${name} PRIVATE ${${library}})
  endforeach()
  set(KALMARM_PEER_MODULES ${KALMARM_PEER_MODULES} PARENT_SCOPE)
endfunction()

file(GLOB_RECURSE own_headers CONFIGURE_DEPENDS
  ${PROJECT_SOURCE_DIR}/algorithms/*.hpp ${PROJECT_SOURCE_DIR}/benchmarks/peers/*.hpp)

# By the other compiler, with the same flags. TAG is what its variants' names end with.
function(kalmarm_peer_by_other_compiler name tag)
  cmake_parse_arguments(ARG "" "" "SOURCES;INCLUDES;DEFINITIONS" ${ARGN})
  separate_arguments(flags UNIX_COMMAND "${KALMARM_FLAGS}")
  list(TRANSFORM ARG_INCLUDES PREPEND -isystem)
  list(TRANSFORM ARG_DEFINITIONS PREPEND -D)
  set(module ${CMAKE_BINARY_DIR}/peers/${name}.so)
  add_custom_command(OUTPUT ${module}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/peers
    COMMAND ${KALMARM_OTHER_COMPILER} -std=c++20 ${flags} -w -fPIC -shared -fvisibility=hidden -I${PROJECT_SOURCE_DIR}
            -I${PROJECT_SOURCE_DIR}/algorithms/include ${ARG_INCLUDES} ${ARG_DEFINITIONS}
            "-DKALMARM_PEER_TAG=\"${tag}\"" ${ARG_SOURCES} -o ${module}
    DEPENDS ${ARG_SOURCES} ${own_headers} VERBATIM)
  list(APPEND KALMARM_PEER_MODULES ${module})
  set(KALMARM_PEER_MODULES ${KALMARM_PEER_MODULES} PARENT_SCOPE)
endfunction()

# What compiles generated code as C, and the folder where that stays.
function(kalmarm_c_compilers module)
  foreach(name gcc clang)
    string(TOUPPER ${name} upper)
    find_program(KALMARM_C_${upper} ${name})
    mark_as_advanced(KALMARM_C_${upper})
    set(path)
    set(version)
    if(KALMARM_C_${upper})
      set(path ${KALMARM_C_${upper}})
      execute_process(COMMAND ${path} --version OUTPUT_VARIABLE version)
      string(REGEX MATCH "[0-9]+\\.[0-9]+\\.[0-9]+" version "${version}")
    endif()
    target_compile_definitions(${module} PRIVATE
      KALMARM_${upper}="${path}" KALMARM_${upper}_VERSION="${version}")
  endforeach()
  target_compile_definitions(${module} PRIVATE KALMARM_GENERATED_FOLDER="${CMAKE_BINARY_DIR}/peers/generated")
endfunction()

# Our own generated code.
kalmarm_peer_module(peer_one_robot ${CMAKE_CURRENT_SOURCE_DIR}/peers/one_robot.cpp)
target_link_libraries(peer_one_robot PRIVATE kalmarm)
target_compile_options(peer_one_robot PRIVATE -O1)
kalmarm_c_compilers(peer_one_robot)

file(GLOB wheel ${PROJECT_SOURCE_DIR}/build/venv-peers/lib/python3*/site-packages/cmeel.prefix/include)
find_path(PINOCCHIO_INCLUDE pinocchio/config.hpp PATHS ${wheel} NO_DEFAULT_PATH)
if(PINOCCHIO_INCLUDE)
  # What Pinocchio's own targets define: its variant of all joints is longer than Boost expects.
  set(KALMARM_PINOCCHIO_DEFINITIONS BOOST_MPL_LIMIT_LIST_SIZE=30 BOOST_MPL_LIMIT_VECTOR_SIZE=30
    BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS BOOST_FUSION_INVOKE_MAX_ARITY=12)
  kalmarm_peer_module(peer_pinocchio ${CMAKE_CURRENT_SOURCE_DIR}/peers/pinocchio.cpp)
  target_include_directories(peer_pinocchio SYSTEM PRIVATE ${PINOCCHIO_INCLUDE})
  target_link_libraries(peer_pinocchio PRIVATE Boost::headers)
  target_compile_definitions(peer_pinocchio PRIVATE ${KALMARM_PINOCCHIO_DEFINITIONS})
  target_compile_options(peer_pinocchio PRIVATE -w)  # gcc takes its packets for reads beyond the end

  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    set(other clang)
    find_program(KALMARM_OTHER_COMPILER clang++)
  else()
    set(other gcc)
    find_program(KALMARM_OTHER_COMPILER g++)
  endif()
  if(KALMARM_OTHER_COMPILER)
    get_target_property(eigen Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
    get_target_property(own kalmarm SOURCES)
    list(TRANSFORM own PREPEND ${PROJECT_SOURCE_DIR}/algorithms/)
    kalmarm_peer_by_other_compiler(peer_fast_${other} "@${other}"
      SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/peers/fast.cpp ${PROJECT_SOURCE_DIR}/algorithms/study/flops/flops.cpp ${own}
      INCLUDES ${eigen} DEFINITIONS ${KALMARM_EIGEN_DEFINITIONS} KALMARM_ENGINES=kalmarm_engines_native)
    kalmarm_peer_by_other_compiler(peer_pinocchio_${other} "" SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/peers/pinocchio.cpp
      INCLUDES ${eigen} ${PINOCCHIO_INCLUDE} DEFINITIONS ${KALMARM_PINOCCHIO_DEFINITIONS})
  endif()
endif()

# Code that Pinocchio generates, which bench_peers compiles as C by each of these that is there. What generates it is
# not timed.
find_path(CPPADCG_INCLUDE cppad/cg.hpp PATHS ${wheel} NO_DEFAULT_PATH)
if(PINOCCHIO_INCLUDE AND CPPADCG_INCLUDE)
  kalmarm_peer_module(peer_generated ${CMAKE_CURRENT_SOURCE_DIR}/peers/generated.cpp)
  target_sources(peer_generated PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/peers/generator.cpp)
  target_include_directories(peer_generated SYSTEM PRIVATE ${PINOCCHIO_INCLUDE} ${CPPADCG_INCLUDE})
  target_link_libraries(peer_generated PRIVATE Boost::headers kalmarm)
  # Pinocchio asks each joint whether it is one of a kind that generator.cpp leaves out: it is not.
  target_compile_definitions(peer_generated PRIVATE ${KALMARM_PINOCCHIO_DEFINITIONS}
    BOOST_VARIANT_USE_RELAXED_GET_BY_DEFAULT)
  target_compile_options(peer_generated PRIVATE -O1 -w)
  kalmarm_c_compilers(peer_generated)
endif()

find_path(DART_INCLUDE dart/dart.hpp)
find_library(DART_LIBRARY dart)
kalmarm_debian_peer(dart DART_INCLUDE DART_LIBRARY)

# Simbody asks for the system's LAPACK, which does not work beside the serial OpenBLAS; that one's does.
find_path(SIMBODY_INCLUDE Simbody.h PATH_SUFFIXES simbody)
cmake_path(GET KalmarmOpenBLAS_LIBRARY PARENT_PATH openblas)
find_library(SERIAL_LAPACK lapack PATHS ${openblas} NO_DEFAULT_PATH)
find_library(SERIAL_BLAS blas PATHS ${openblas} NO_DEFAULT_PATH)
find_library(SIMBODY_LIBRARY SimTKsimbody)
find_library(SIMMATH_LIBRARY SimTKmath)
find_library(SIMCOMMON_LIBRARY SimTKcommon)
kalmarm_debian_peer(simbody SIMBODY_INCLUDE SERIAL_LAPACK SERIAL_BLAS SIMBODY_LIBRARY SIMMATH_LIBRARY SIMCOMMON_LIBRARY)
if(TARGET peer_simbody)
  target_link_options(peer_simbody PRIVATE -Wl,--no-as-needed)
  set_target_properties(peer_simbody PROPERTIES CXX_STANDARD 17)  # its comparisons are ambiguous in C++20
endif()

find_path(BULLET_INCLUDE btBulletDynamicsCommon.h PATH_SUFFIXES bullet)
find_library(BULLET_DYNAMICS BulletDynamics-float64)
find_library(BULLET_COLLISION BulletCollision-float64)
find_library(BULLET_MATH LinearMath-float64)
kalmarm_debian_peer(bullet BULLET_INCLUDE BULLET_DYNAMICS BULLET_COLLISION BULLET_MATH)
if(TARGET peer_bullet)
  target_compile_definitions(peer_bullet PRIVATE BT_USE_DOUBLE_PRECISION)
endif()

find_path(KDL_INCLUDE kdl/chain.hpp)
find_library(KDL_LIBRARY orocos-kdl)
kalmarm_debian_peer(kdl KDL_INCLUDE KDL_LIBRARY)

mark_as_advanced(PINOCCHIO_INCLUDE CPPADCG_INCLUDE KALMARM_OTHER_COMPILER DART_INCLUDE DART_LIBRARY SIMBODY_INCLUDE
  SERIAL_LAPACK SERIAL_BLAS SIMBODY_LIBRARY SIMMATH_LIBRARY SIMCOMMON_LIBRARY BULLET_INCLUDE BULLET_DYNAMICS
  BULLET_COLLISION BULLET_MATH KDL_INCLUDE KDL_LIBRARY)
