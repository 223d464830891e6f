# Writes the checkout's revision to OUTPUT if it has changed: cmake -DSOURCE=… -DOUTPUT=… -P revision.cmake
execute_process(COMMAND git describe --always --dirty --abbrev=12 WORKING_DIRECTORY ${SOURCE}
                OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT revision)
  set(revision unknown)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define KALMARM_REVISION \"${revision}\"\n")
