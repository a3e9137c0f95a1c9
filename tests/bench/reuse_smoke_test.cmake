# That `reuse` measures a small scene of our own after a motion with a number of samples a step, and refuses motions that
# there are not before it renders anything. usage: cmake -DBENCH=PROGRAM -DFOLDER=FOLDER -P reuse_smoke_test.cmake
set(small reuse cornell-box --samples 4 --seeds 1 --size 16 --cache ${FOLDER}/cache --json)
foreach(motion path-3 turn-5@8 path-5@0 path-5@x all)
  execute_process(COMMAND ${BENCH} ${small} --motions turn-5,${motion}
    OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
  if(NOT code EQUAL 2 OR NOT notes MATCHES "--motions")
    message(FATAL_ERROR "${motion}: exit code ${code}: ${notes}")
  endif()
endforeach()
execute_process(COMMAND ${BENCH} ${small} --motions path-50@2
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(code EQUAL 77)
  message(STATUS "${notes}")
  return()
elseif(NOT code EQUAL 0)
  message(FATAL_ERROR "exit code ${code}: ${notes}")
endif()
execute_process(COMMAND ${BENCH} ${small} --motions path-50@2 --ours-alone
  OUTPUT_VARIABLE alone ERROR_VARIABLE notes RESULT_VARIABLE code)
string(JSON value ERROR_VARIABLE absent GET "${alone}" figures cornell-box.path-50@2.error_over_restart.at_4 value)
if(NOT code EQUAL 0 OR absent OR alone MATCHES "paper_")
  message(FATAL_ERROR "--ours-alone: exit code ${code}: ${notes} ${absent}")
endif()
foreach(name combined_over_restart reproject_over_restart paper_combined_over_restart
    error_over_restart.at_1 error_over_restart.at_4 cost_of_one_sample.frame at_last.within_three)
  string(JSON value ERROR_VARIABLE absent GET "${json}" figures cornell-box.path-50@2.${name} value)
  if(absent OR NOT value GREATER_EQUAL 0)
    message(FATAL_ERROR "${name}: ${value} ${absent}")
  endif()
endforeach()
