# kalmarm_command: programs in one executable, which holds what they share once. The Python wheel carries it; a program
# joins with its name in this list. Every whole build makes it, so that what breaks it is seen before a wheel is made.
set(programs
  bench_batch
  bench_dynamics
  bench_inverse
  compare_mujoco
  evaluate
  generate
  limits
  plan
  recommend
  scaling)

add_executable(kalmarm_command accuracy/programs/command.cpp)
target_link_options(kalmarm_command PRIVATE -Wl,--gc-sections)  # of scripts/flint's archive, whose sections are functions
set(list)
foreach(program IN LISTS programs)
  get_target_property(folder ${program} SOURCE_DIR)
  get_target_property(libraries ${program} LINK_LIBRARIES)
  get_target_property(sources ${program} SOURCES)
  set(paths)
  foreach(source IN LISTS sources)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${folder})
    list(APPEND paths ${source})
  endforeach()
  add_library(${program}_called OBJECT EXCLUDE_FROM_ALL ${paths})
  target_compile_definitions(${program}_called PRIVATE main=${program}_main)
  target_compile_options(${program}_called PRIVATE -O1)
  target_link_libraries(${program}_called PRIVATE ${libraries})
  target_link_libraries(kalmarm_command PRIVATE ${program}_called ${libraries})
  string(APPEND list "KALMARM_PROGRAM(${program}) ")
endforeach()
target_compile_definitions(kalmarm_command PRIVATE "KALMARM_PROGRAMS=${list}")
