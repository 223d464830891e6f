# The compiler behind ccache, where that is installed and nobody chose another launcher: a second build, or one in a fresh
# clone, takes what an earlier one compiled.
find_program(KALMARM_CCACHE ccache)
if(NOT KALMARM_CCACHE OR DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  return()
endif()
cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH checkout)
cmake_path(GET checkout PARENT_PATH checkout)
set(settings
  # Paths below the checkout are relative in the key, so that another folder finds the same.
  CCACHE_BASEDIR=${checkout}
  # What ccache asks for before it keeps precompiled headers. Nothing here is compiled from __TIME__.
  CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime)
if(KALMARM_NATIVE)
  # -march=native means another code on another processor: the key has the options that it stands for here.
  list(APPEND settings "CCACHE_COMPILERCHECK=%compiler% -march=native -E -v -x c++ /dev/null")
endif()
set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env ${settings} ${KALMARM_CCACHE})
if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
  list(APPEND CMAKE_CXX_COMPILE_OPTIONS_CREATE_PCH -Xclang -fno-pch-timestamp)
endif()
