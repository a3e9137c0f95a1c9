# Runs the quickest subcommand and reads its JSON. usage: cmake -DBENCH=PROGRAM -P smoke_test.cmake
execute_process(COMMAND ${BENCH} features --repeat 1 --size 64 --json
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(code EQUAL 77)
  message(STATUS "${notes}")
  return()
elseif(NOT code EQUAL 0)
  message(FATAL_ERROR "exit code ${code}: ${notes}")
endif()
foreach(name cornell.kernel_gain cornell.chosen_kernel.seconds_per_sample cornell.general_kernel.seconds_per_sample)
  string(JSON value GET "${json}" figures ${name} value)
  string(JSON unit GET "${json}" figures ${name} unit)
  string(JSON goal_type TYPE "${json}" figures ${name} goal)
  string(JSON better GET "${json}" figures ${name} better)
  if(NOT value GREATER 0 OR NOT unit MATCHES "^(x|s)$" OR NOT goal_type STREQUAL "NULL"
      OR NOT better MATCHES "^(lower|higher)$")
    message(FATAL_ERROR "${name}: value ${value}, unit ${unit}, goal ${goal_type}, better ${better}")
  endif()
endforeach()
