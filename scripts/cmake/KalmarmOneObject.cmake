# kalmarm_one_object(RESULT NAME OBJECTS object… OBJCOPY option…)
#
# Links objects into one, RESULT, in which all is local but what objcopy's options keep. In an archive, what templates
# and inline functions define would stay weak, and the linker of a program would keep one copy: of whichever instruction
# set, and of Eigen whichever version and alignment, ours or the program's.
function(kalmarm_one_object result name)
  cmake_parse_arguments(ARG "" "" "OBJECTS;OBJCOPY" ${ARGN})
  set(object ${CMAKE_CURRENT_BINARY_DIR}/${name}.o)
  add_custom_command(OUTPUT ${object}
    COMMAND ${CMAKE_CXX_COMPILER} -r -nostdlib -fuse-ld=bfd -Wl,--force-group-allocation ${ARG_OBJECTS} -o ${object}.all
    COMMAND ${CMAKE_OBJCOPY} --wildcard ${ARG_OBJCOPY} ${object}.all ${object}
    COMMAND ${CMAKE_COMMAND} -E rm ${object}.all
    DEPENDS ${ARG_OBJECTS} COMMAND_EXPAND_LISTS VERBATIM)
  set_source_files_properties(${object} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  set(${result} ${object} PARENT_SCOPE)
endfunction()

# kalmarm_sealed_library(TARGET SOURCES source… [OBJECTS object…]): TARGET shows KALMARM_EXPORT alone. Where tests
# reach inside, all of the archive can be linked to.
function(kalmarm_sealed_library target)
  cmake_parse_arguments(ARG "" "" "SOURCES;OBJECTS" ${ARGN})
  get_target_property(type ${target} TYPE)
  if(type STREQUAL SHARED_LIBRARY)
    set(map ${PROJECT_SOURCE_DIR}/scripts/cmake/exported.map)
    # its own templates, also where a program has the same ones of other flags
    target_link_options(${target} PRIVATE -Wl,--version-script=${map} -Wl,--no-undefined -Wl,-Bsymbolic-functions)
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${map})
  endif()
  if(KALMARM_TESTED OR KALMARM_SANITIZE)
    target_sources(${target} PRIVATE ${ARG_SOURCES} ${ARG_OBJECTS})
    return()
  endif()

  set(library ${target}_objects)
  add_library(${library} OBJECT ${ARG_SOURCES})
  kalmarm_flags(${library})
  foreach(property COMPILE_DEFINITIONS INCLUDE_DIRECTORIES)  # as TARGET will have them in the end
    set_property(TARGET ${library} APPEND PROPERTY ${property} $<TARGET_PROPERTY:${target},${property}>)
  endforeach()
  set(objects $<TARGET_OBJECTS:${library}> ${ARG_OBJECTS})
  set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX)
  if(NOT type STREQUAL SHARED_LIBRARY)
    # of ours, not those of std that are made with our types
    kalmarm_one_object(objects ${target} OBJECTS ${objects}
                       OBJCOPY --localize-hidden --keep-global-symbol=_ZN7kalmarm* --keep-global-symbol=_ZNK7kalmarm*
                               --keep-global-symbol=_ZT?N7kalmarm*)
  endif()
  target_sources(${target} PRIVATE ${objects})
endfunction()
