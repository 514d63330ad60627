# dyxel_library(<folder> [SOURCES ..] HEADERS .. [DEPENDS ..] [PACKAGES ..] [SYSTEM_INCLUDES ..]
#               [TESTS ..] [BENCHES ..] [TEST_DEPENDS ..])
#
# One folder of src/dyxel is one library, dyxel::<folder>. DEPENDS names the folders that it may
# use, all of lower floors (DYXEL_FLOOR_<folder> below); an #include of any other folder fails
# here, at configure time. PACKAGES are link targets of libraries from outside. Every x_test.cc
# becomes the CTest test <folder>/x_test, every x_bench.cc the executable <folder>_x_bench; only
# these see TEST_DEPENDS.

# The highest folder of the floor below each folder (design: "The house"). A folder may include
# only folders of a lower number.
set(DYXEL_FLOOR_base 0)
set(DYXEL_FLOOR_math 1)
set(DYXEL_FLOOR_image 2)
set(DYXEL_FLOOR_capture 3)
set(DYXEL_FLOOR_mesh 3)
set(DYXEL_FLOOR_reflectance 2)
set(DYXEL_FLOOR_texture 4)
set(DYXEL_FLOOR_body 4)
set(DYXEL_FLOOR_tracking 5)
set(DYXEL_FLOOR_video 5)
set(DYXEL_FLOOR_render 6)
set(DYXEL_FLOOR_studio 6)
set(DYXEL_FLOOR_pipeline 7)
set(DYXEL_FLOOR_app 8)

function(dyxel_library folder)
  cmake_parse_arguments(arg "" ""
    "SOURCES;HEADERS;DEPENDS;PACKAGES;SYSTEM_INCLUDES;TESTS;BENCHES;TEST_DEPENDS" ${ARGN})
  set(target dyxel_${folder})

  foreach(dependency IN LISTS arg_DEPENDS)
    string(REPLACE "dyxel::" "" used "${dependency}")
    if(NOT DEFINED DYXEL_FLOOR_${used})
      message(FATAL_ERROR "${folder}: DEPENDS names ${dependency}, which is no folder of the house")
    endif()
    if(NOT DYXEL_FLOOR_${used} LESS DYXEL_FLOOR_${folder})
      message(FATAL_ERROR "${folder}: DEPENDS names ${dependency}, which is not on a lower floor")
    endif()
  endforeach()
  foreach(source IN LISTS arg_SOURCES arg_HEADERS)
    file(STRINGS ${source} includes REGEX "^[ \t]*#[ \t]*include[ \t]*[\"<]dyxel/")
    foreach(include IN LISTS includes)
      string(REGEX REPLACE ".*[\"<]dyxel/([a-z_]+)/.*" "\\1" used "${include}")
      if(NOT used STREQUAL folder AND NOT "dyxel::${used}" IN_LIST arg_DEPENDS)
        message(FATAL_ERROR "${folder}/${source} includes dyxel/${used}: not in its DEPENDS")
      endif()
    endforeach()
    # An include added later must be checked too: configure again when a file changes.
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
      ${CMAKE_CURRENT_SOURCE_DIR}/${source})
  endforeach()

  if(arg_SOURCES)
    add_library(${target} STATIC ${arg_SOURCES} ${arg_HEADERS})
    set(scope PUBLIC)
    dyxel_compile_options(${target})
    target_compile_options(${target} PRIVATE -Wdouble-promotion)
  else()
    add_library(${target} INTERFACE ${arg_HEADERS})
    set(scope INTERFACE)
  endif()
  add_library(dyxel::${folder} ALIAS ${target})
  target_include_directories(${target} ${scope} ${PROJECT_SOURCE_DIR}/src)
  target_compile_features(${target} ${scope} cxx_std_20)
  target_link_libraries(${target} ${scope} ${arg_DEPENDS} ${arg_PACKAGES})
  if(arg_SYSTEM_INCLUDES)
    target_include_directories(${target} SYSTEM ${scope} ${arg_SYSTEM_INCLUDES})
  endif()

  if(DYXEL_TESTS)
    foreach(source IN LISTS arg_TESTS)
      cmake_path(GET source STEM name)
      add_executable(${folder}_${name} ${source})
      dyxel_compile_options(${folder}_${name})
      target_link_libraries(${folder}_${name} PRIVATE dyxel::${folder} ${arg_TEST_DEPENDS}
                                                      GTest::gmock_main)
      add_test(NAME ${folder}/${name} COMMAND ${folder}_${name})
      set_tests_properties(${folder}/${name} PROPERTIES TIMEOUT 900)
    endforeach()
  endif()
  if(DYXEL_BENCHES)
    foreach(source IN LISTS arg_BENCHES)
      cmake_path(GET source STEM name)
      add_executable(${folder}_${name} ${source})
      dyxel_compile_options(${folder}_${name})
      target_link_libraries(${folder}_${name} PRIVATE dyxel::${folder} ${arg_TEST_DEPENDS}
                                                      benchmark::benchmark_main)
    endforeach()
  endif()
endfunction()

# -fno-math-errno and -fno-trapping-math let loops vectorise; -ffast-math breaks NaN as "unknown".
function(dyxel_compile_options target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wno-missing-field-initializers -fno-math-errno
                                           -fno-trapping-math -ffp-contract=fast)
  if(DYXEL_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(DYXEL_ARCH)
    target_compile_options(${target} PUBLIC -march=${DYXEL_ARCH})
  endif()
  if(DYXEL_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${DYXEL_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${DYXEL_SANITIZE})
  endif()
  if(DYXEL_COVERAGE)
    target_compile_options(${target} PRIVATE --coverage)
    target_link_options(${target} PUBLIC --coverage)
  endif()
endfunction()
