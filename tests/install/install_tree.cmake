# Installs BUILD into TREE and looks at what is there.
file(REMOVE_RECURSE ${TREE})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${TREE}
                RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE err)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "cmake --install: ${err}")
endif()

foreach(file
    bin/heliograph
    bin/heliographd
    lib/systemd/system/heliographd.service
    share/man/man1/heliograph.1.gz
    share/man/man8/heliographd.8.gz
    share/doc/heliograph/copyright
    share/doc/heliograph/examples/heliographd.conf
    share/doc/heliograph-dev/copyright
    share/doc/heliograph-dev/examples/client-example/main.cpp
    share/heliograph/proto/heliograph/v1/render_service.proto
    include/heliograph/client/render_client.h
    include/heliograph/heliograph/v1/render_service.grpc.pb.h
    ${LIBRARIES}/libheliograph-client.a
    ${LIBRARIES}/cmake/Heliograph/HeliographConfig.cmake
    ${LIBRARIES}/cmake/Heliograph/HeliographConfigVersion.cmake)
  if(NOT EXISTS ${TREE}/${file})
    message(SEND_ERROR "${file} is not installed")
  endif()
endforeach()

# Headers of ours include only what is installed beside them, and .proto files likewise.
file(GLOB_RECURSE headers RELATIVE ${TREE}/include/heliograph ${TREE}/include/heliograph/*.h)
foreach(header IN LISTS headers)
  file(STRINGS ${TREE}/include/heliograph/${header} lines REGEX "^#include \"")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" included "${line}")
    if(included MATCHES "^google/")
      continue()
    endif()
    if(NOT EXISTS ${TREE}/include/heliograph/${included})
      message(SEND_ERROR "${header} includes ${included}, which is not installed")
    endif()
  endforeach()
endforeach()
file(GLOB_RECURSE protos ${TREE}/share/heliograph/proto/*.proto)
foreach(proto IN LISTS protos)
  file(STRINGS ${proto} lines REGEX "^import \"heliograph/")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE "^import \"([^\"]+)\".*" "\\1" imported "${line}")
    if(NOT EXISTS ${TREE}/share/heliograph/proto/${imported})
      message(SEND_ERROR "${proto} imports ${imported}, which is not installed")
    endif()
  endforeach()
endforeach()

file(GLOB_RECURSE stray RELATIVE ${TREE} ${TREE}/*_test* ${TREE}/*.pch ${TREE}/*.gch ${TREE}/*.o)
if(stray)
  message(SEND_ERROR "installed by mistake: ${stray}")
endif()
file(REMOVE_RECURSE ${TREE})
