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
  # Of the objects of the program itself, linked into one whose main has another name: nothing is compiled twice.
  set(object ${CMAKE_CURRENT_BINARY_DIR}/called/${program}.o)
  add_custom_command(OUTPUT ${object}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_CURRENT_BINARY_DIR}/called
    COMMAND ${CMAKE_LINKER} -r -o ${object} $<TARGET_OBJECTS:${program}>
    COMMAND ${CMAKE_OBJCOPY} --redefine-sym main=${program}_main ${object}
    DEPENDS $<TARGET_OBJECTS:${program}> COMMAND_EXPAND_LISTS VERBATIM)
  get_target_property(libraries ${program} LINK_LIBRARIES)
  target_sources(kalmarm_command PRIVATE ${object})
  target_link_libraries(kalmarm_command PRIVATE ${libraries})
  string(APPEND list "KALMARM_PROGRAM(${program}) ")
endforeach()
target_compile_definitions(kalmarm_command PRIVATE "KALMARM_PROGRAMS=${list}")
