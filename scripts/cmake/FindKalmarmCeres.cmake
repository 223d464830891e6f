# Ceres::shared: Ceres as a shared library, whose Eigen is kept apart from this project's. Ceres::cost_functions: the
# class alone.
#
# Its own CMake package links it statically. Then the linker would keep one of each of Eigen's functions, of Ceres'
# (compiled for any x86-64) or ours (for this processor), and they differ in how they align memory: what one allocates
# the other cannot free.
find_path(CERES_INCLUDE ceres/ceres.h)
find_library(CERES_LIBRARY NAMES libceres.so)
find_library(CERES_ARCHIVE NAMES libceres.a)
find_library(GLOG_LIBRARY glog)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(KalmarmCeres REQUIRED_VARS CERES_LIBRARY CERES_ARCHIVE CERES_INCLUDE GLOG_LIBRARY)
if(KalmarmCeres_FOUND AND NOT TARGET Ceres::shared)
  add_library(Ceres::shared SHARED IMPORTED)
  set_target_properties(Ceres::shared PROPERTIES
    IMPORTED_LOCATION ${CERES_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${CERES_INCLUDE}
    INTERFACE_LINK_LIBRARIES ${GLOG_LIBRARY}
    INTERFACE_LINK_OPTIONS -Wl,--version-script=${CMAKE_CURRENT_LIST_DIR}/eigen_stays_here.map)
  # Cost functions without the solver, for programs with the serial OpenBLAS: all that is taken from the archive is the
  # class CostFunction, which knows neither Eigen nor LAPACK.
  add_library(Ceres::cost_functions INTERFACE IMPORTED)
  target_include_directories(Ceres::cost_functions INTERFACE ${CERES_INCLUDE})
  target_link_libraries(Ceres::cost_functions INTERFACE ${CERES_ARCHIVE} ${GLOG_LIBRARY})
endif()
