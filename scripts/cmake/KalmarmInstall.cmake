# cmake --install and cpack. Components: runtime (shared libraries), development (headers, archive, CMake and pkg-config
# files), robots (the loader). find_package takes a build folder as well, as kalmarm_DIR.
include(CMakePackageConfigHelpers)

set(config ${CMAKE_INSTALL_LIBDIR}/cmake/kalmarm)
set(files ${CMAKE_CURRENT_LIST_DIR})
set(made ${PROJECT_BINARY_DIR})

function(kalmarm_install target export headers component)
  install(TARGETS ${target} EXPORT ${export}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT ${component}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${component})
  install(EXPORT ${export} NAMESPACE kalmarm:: DESTINATION ${config} COMPONENT ${component})
  export(EXPORT ${export} NAMESPACE kalmarm:: FILE ${made}/${export}.cmake)
  install(DIRECTORY ${headers}/kalmarm DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT ${component}
    FILES_MATCHING PATTERN *.hpp)
endfunction()

# --- pkg-config: from the folder of the .pc file, so that the whole can be moved
file(RELATIVE_PATH pc_to_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
get_target_property(type kalmarm TYPE)
set(pc_private_libs)
if(type STREQUAL STATIC_LIBRARY)
  set(pc_private_libs "-lstdc++ -lm -ldl -pthread")
endif()
function(kalmarm_pkg_config name)
  configure_file(${files}/${name}.pc.in ${made}/${name}.pc @ONLY)
  install(FILES ${made}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT ${ARGN})
endfunction()

kalmarm_install(kalmarm kalmarmTargets ${PROJECT_SOURCE_DIR}/algorithms/include development)
kalmarm_pkg_config(kalmarm development)

# Where the loader's MuJoCo is: a CMake package that users find again, or a library of the machine it was built on.
set(KALMARM_MUJOCO_LIBRARY)
set(KALMARM_MUJOCO_PACKAGE)
if(TARGET kalmarm_robots)
  if(mujoco_FOUND)
    set(KALMARM_MUJOCO_PACKAGE 3.10)
    set(pc_mujoco -lmujoco)
  else()
    set(KALMARM_MUJOCO_LIBRARY ${KalmarmMujoco_LIBRARY})
    cmake_path(GET KalmarmMujoco_LIBRARY PARENT_PATH folder)
    set(pc_mujoco "${KalmarmMujoco_LIBRARY} -Wl,-rpath,${folder}")
  endif()
  kalmarm_install(kalmarm_robots kalmarmRobotsTargets ${PROJECT_SOURCE_DIR}/robots/include robots)
  kalmarm_pkg_config(kalmarm-robots robots)
endif()

# --- find_package
configure_package_config_file(${files}/kalmarmConfig.cmake.in ${made}/kalmarmConfig.cmake INSTALL_DESTINATION ${config}
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${made}/kalmarmConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${made}/kalmarmConfig.cmake ${made}/kalmarmConfigVersion.cmake DESTINATION ${config}
  COMPONENT development)
install(FILES ${PROJECT_SOURCE_DIR}/package.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/kalmarm COMPONENT development)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
if(KALMARM_NATIVE)
  install(CODE "message(NOTICE \"kalmarm: these libraries are for this machine's processor alone (KALMARM_NATIVE)\")"
    ALL_COMPONENTS)
endif()

# --- packages: one .tar.gz of everything; Debian's by component
if(PROJECT_IS_TOP_LEVEL)
  set(CPACK_GENERATOR TGZ DEB)
  set(CPACK_SOURCE_GENERATOR)
  set(CPACK_PACKAGE_NAME kalmarm)
  set(CPACK_PACKAGE_VENDOR Kalmarm)
  set(CPACK_PACKAGE_CONTACT "Kalmarm maintainers <maintainers@kalmarm.invalid>")
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_STRIP_FILES OFF)
  set(CPACK_COMPONENTS_ALL development)
  if(TARGET kalmarm_robots)
    list(APPEND CPACK_COMPONENTS_ALL robots)
  endif()
  if(type STREQUAL SHARED_LIBRARY)
    list(APPEND CPACK_COMPONENTS_ALL runtime)
    set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS runtime)
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  endif()
  set(CPACK_COMPONENT_ROBOTS_DEPENDS development)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libkalmarm${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libkalmarm-dev)
  set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
  set(CPACK_DEBIAN_ROBOTS_PACKAGE_NAME libkalmarm-robots-dev)
  set(CPACK_DEBIAN_ROBOTS_PACKAGE_SECTION libdevel)
  set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "Shared libraries.")
  set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers, library, CMake and pkg-config files.")
  set(CPACK_COMPONENT_ROBOTS_DESCRIPTION "The loader of MJCF and URDF files, which needs MuJoCo ${KalmarmMujoco_VERSION}.")
  include(CPack)
endif()
