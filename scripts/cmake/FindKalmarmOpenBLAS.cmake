# Single-threaded OpenBLAS with LAPACKE as target OpenBLAS::serial.
#
# Debian's alternatives point libopenblas.so, libblas.so and liblapack.so at the threaded build wherever that is
# installed, so the serial one is linked by its own folder. LAPACKE is linked from its archive: liblapacke.so would load
# the alternative's liblapack.so.3, which does not work on top of the serial libopenblas.so.0. Ceres' library loads it,
# too: no program can link both; its cost functions alone (Ceres::cost_functions) it can.

find_library(KalmarmOpenBLAS_LIBRARY openblas PATH_SUFFIXES openblas-serial)
find_library(KalmarmOpenBLAS_LAPACKE liblapacke.a)
find_path(KalmarmOpenBLAS_INCLUDE_DIR cblas.h PATH_SUFFIXES openblas-serial)
mark_as_advanced(KalmarmOpenBLAS_LIBRARY KalmarmOpenBLAS_LAPACKE KalmarmOpenBLAS_INCLUDE_DIR)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  KalmarmOpenBLAS
  REQUIRED_VARS KalmarmOpenBLAS_LIBRARY KalmarmOpenBLAS_LAPACKE KalmarmOpenBLAS_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "run scripts/setup, which installs it")

if(KalmarmOpenBLAS_FOUND AND NOT TARGET OpenBLAS::serial)
  add_library(OpenBLAS::serial INTERFACE IMPORTED)
  target_include_directories(OpenBLAS::serial INTERFACE "${KalmarmOpenBLAS_INCLUDE_DIR}")
  target_link_libraries(OpenBLAS::serial INTERFACE "${KalmarmOpenBLAS_LAPACKE}"
                                                   "${KalmarmOpenBLAS_LIBRARY}")
endif()
