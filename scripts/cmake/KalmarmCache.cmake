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
  if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    set(in_a_folder " -ffile-compilation-dir=.")  # else clang says in which one it runs
  endif()
  list(APPEND settings "CCACHE_COMPILERCHECK=%compiler% -march=native${in_a_folder} -E -v -x c++ /dev/null")
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
  # What clang precompiles holds the folder it stands in, and CMake's options to use it hold that folder where ccache does
  # not look for paths. So the key has a sum beside it (kalmarm_sum_of_precompiled), and clang finds it by the header's name.
  list(APPEND settings CCACHE_PCH_EXTSUM=true)
  set(CMAKE_CXX_COMPILE_OPTIONS_USE_PCH -include <PCH_HEADER>)
endif()
set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env ${settings} ${KALMARM_CCACHE})

# For ccache, of what clang precompiles for a target from headers of the system: their whole text.
function(kalmarm_sum_of_precompiled target include_folders headers)
  list(TRANSFORM headers PREPEND "#include ")
  list(JOIN headers "\n" text)
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/${target}_headers.cpp "${text}\n")
  list(TRANSFORM include_folders PREPEND -isystem)
  execute_process(COMMAND ${CMAKE_CXX_COMPILER} -std=c++${CMAKE_CXX_STANDARD} ${include_folders} -E -P
    ${CMAKE_CURRENT_BINARY_DIR}/${target}_headers.cpp OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(SHA256 sum "${text}")
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/cmake_pch.hxx.pch.sum "${sum}\n")
endfunction()
