# That `peers` measures a small scene of our own, also where Mitsuba is absent, and writes its files.
# usage: cmake -DBENCH=PROGRAM -DFOLDER=FOLDER -DFAKE_OIDN=LIBRARY -P curves_smoke_test.cmake
file(REMOVE_RECURSE ${FOLDER})
file(WRITE ${FOLDER}/wall.xml "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='4'/>\
</integrator><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='16'/><integer name='height' \
value='16'/></film></sensor><shape type='rectangle'><transform name='to_world'><rotate y='1' angle='180'/>\
<scale value='9'/><translate z='3'/></transform><bsdf type='diffuse'/></shape><shape type='rectangle'>\
<transform name='to_world'><scale value='2'/><translate x='1' z='-1'/></transform><emitter type='area'/></shape></scene>")
execute_process(COMMAND ${BENCH} peers ${FOLDER}/wall.xml --samples 4 --seeds 2 --size 16 --cache ${FOLDER}/cache
                        --mitsuba-python ${FOLDER}/none --output ${FOLDER} --json
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "exit code ${code}: ${notes}")
endif()
string(JSON name GET "${json}" comparisons 0 name)
string(JSON mode GET "${json}" comparisons 0 modes 0)
string(JSON budgets LENGTH "${json}" comparisons 0 budgets)
if(NOT name STREQUAL "wall" OR NOT mode STREQUAL "pt" OR NOT budgets EQUAL 3)  # 1, 2 and 4 samples
  message(FATAL_ERROR "comparison ${name}, mode ${mode}, ${budgets} budgets")
endif()
# Of one point the mean of a measure of the whole picture.
function(get_value result comparison point measure)
  string(JSON count LENGTH "${json}" comparisons ${comparison} points ${point} values)
  math(EXPR last "${count} - 1")
  foreach(i RANGE ${last})
    string(JSON found GET "${json}" comparisons ${comparison} points ${point} values ${i} measure)
    string(JSON region GET "${json}" comparisons ${comparison} points ${point} values ${i} region)
    if(found STREQUAL measure AND region STREQUAL "")
      string(JSON value GET "${json}" comparisons ${comparison} points ${point} values ${i} mean)
      set(${result} ${value} PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "no ${measure} of point ${point} of comparison ${comparison}")
endfunction()
# More samples leave less error, and the reference has one of its own.
get_value(coarse 0 0 mse)
get_value(fine 0 2 mse)
string(JSON seconds GET "${json}" comparisons 0 points 2 seconds mean)
string(JSON error GET "${json}" comparisons 0 references 0 error)
if(NOT seconds GREATER 0 OR NOT error GREATER 0 OR NOT coarse GREATER ${fine} OR NOT fine GREATER 0)
  message(FATAL_ERROR "mse ${coarse}, then ${fine} in ${seconds} s; relative error of the reference ${error}")
endif()
# In XML files the longest path and the filter are the file's: of a lamp that fills the view a path of one segment brings
# its own light alone, in every sample.
file(WRITE ${FOLDER}/lamp.xml "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='1'/>\
</integrator><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='16'/><integer name='height' \
value='16'/></film></sensor><shape type='rectangle'><transform name='to_world'><rotate y='1' angle='180'/>\
<scale value='9'/><translate z='3'/></transform><bsdf type='diffuse'/><emitter type='area'/></shape><shape type='sphere'>\
<point name='center' x='0' y='0' z='-2'/><emitter type='area'/></shape></scene>")
execute_process(COMMAND ${BENCH} peers ${FOLDER}/lamp.xml --samples 2 --seeds 1 --size 16 --cache ${FOLDER}/cache
                        --mitsuba-python ${FOLDER}/none --output ${FOLDER}/lamp --json
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "peers lamp.xml: exit code ${code}: ${notes}")
endif()
get_value(error 0 0 mse)
if(error GREATER 1e-10)
  message(FATAL_ERROR "peers lamp.xml: mse ${error} of a picture of one value")
endif()
# And that `adaptive` finds what an allocation could gain.
execute_process(COMMAND ${BENCH} adaptive cornell-box --samples 32 --seeds 1 --size 32 --cache ${FOLDER}/cache --json
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "adaptive: exit code ${code}: ${notes}")
endif()
foreach(metric relmse mse)
  foreach(name ceiling share_of_ceiling bounded.error_over_uniform paper.error_over_uniform)
    string(JSON value GET "${json}" figures cornell-box.adaptive.${metric}.${name} value)
    string(JSON median GET "${json}" figures all.adaptive.${metric}.${name}.median value)
    if(NOT value GREATER 0 OR NOT median EQUAL value)
      message(FATAL_ERROR "cornell-box.adaptive.${metric}.${name} is ${value}, the median ${median}")
    endif()
  endforeach()
endforeach()
# And that `denoisers` compares both filters with the film. The stand-in for Open Image Denoise takes no time, and its
# picture is far off whatever the samples.
execute_process(COMMAND ${BENCH} denoisers cornell-box --size 32 --cache ${FOLDER}/cache --oidn-library ${FAKE_OIDN}
                        --json
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "denoisers: exit code ${code}: ${notes}")
endif()
foreach(name raw.relmse raw.seconds own.relmse own.seconds oidn.relmse oidn.seconds)
  string(JSON ${name} GET "${json}" figures cornell-box.${name}.4 value)
endforeach()
string(JSON gain GET "${json}" figures cornell-box.own.relmse_over_raw.4 value)
string(JSON as_long GET "${json}" figures cornell-box.oidn.raw_samples.4 value)
string(JSON stand_in GET "${json}" figures cornell-box.oidn.relmse.256 value)
if(NOT raw.relmse GREATER ${own.relmse} OR NOT own.seconds GREATER ${raw.seconds} OR NOT gain LESS 1
    OR NOT as_long EQUAL 4 OR NOT stand_in GREATER 0.1)
  message(FATAL_ERROR "denoisers: ${json}")
endif()
# And that `turns` compares the paper's settings and ours along two turns of 50 degrees.
execute_process(COMMAND ${BENCH} turns box-area --degrees 50 --step-samples 8 --samples 4 --seeds 1 --size 16
                        --cache ${FOLDER}/cache --output ${FOLDER} --json
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "turns: exit code ${code}: ${notes}")
endif()
string(JSON modes LENGTH "${json}" comparisons 0 modes)
string(JSON points LENGTH "${json}" comparisons 0 points)
string(JSON name GET "${json}" comparisons 0 name)
if(NOT modes EQUAL 11 OR NOT points EQUAL 33 OR NOT name STREQUAL "box-area-50-degrees-8-samples")  # 1, 2 and 4 samples
  message(FATAL_ERROR "${modes} modes, ${points} points of ${name}")
endif()
foreach(point RANGE 32)
  get_value(variance 0 ${point} distance-variance)
  if(NOT variance GREATER 0)
    message(FATAL_ERROR "turns, point ${point}: variance of the distance ${variance}")
  endif()
endforeach()
execute_process(COMMAND ${BENCH} turns box-area --degrees 7
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(NOT code EQUAL 1 OR NOT notes MATCHES "7 is none of 5, 10, 20, 50")
  message(FATAL_ERROR "turns --degrees 7: exit code ${code}: ${notes}")
endif()
# And `reuse`, with the paper's modes beside ours.
execute_process(COMMAND ${BENCH} reuse box-area --motions turn-5,out-and-back --samples 4 --seeds 1 --size 16
                        --cache ${FOLDER}/cache --json
  OUTPUT_VARIABLE json ERROR_VARIABLE notes RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "reuse: exit code ${code}: ${notes}")
endif()
foreach(name paper_combined_over_restart paper_reproject_over_restart error_over_restart ceiling newly_seen
             at_two.reported_over_true at_last.within_three cost_of_one_sample.passes cost_of_four_samples.passes)
  string(JSON value GET "${json}" figures box-area.turn-5.${name} value)
  string(JSON worst GET "${json}" figures all.turn-5.${name}.worst value)
  if(NOT value GREATER 0 OR NOT worst EQUAL value)
    message(FATAL_ERROR "box-area.turn-5.${name} is ${value}, the worst of all ${worst}")
  endif()
endforeach()
string(JSON newly_seen GET "${json}" figures box-area.out-and-back.newly_seen value)
if(NOT newly_seen EQUAL 0 OR NOT notes MATCHES "out-and-back: nothing is newly seen")
  message(FATAL_ERROR "newly seen after coming back: ${newly_seen}; ${notes}")
endif()
foreach(comparison wall lamp/lamp box-area-50-degrees-8-samples)
  foreach(name comparison.json units.csv points.csv ratios.csv report.html)
    if(NOT EXISTS ${FOLDER}/${comparison}/${name})
      message(FATAL_ERROR "${comparison}/${name} was not written")
    endif()
  endforeach()
endforeach()
