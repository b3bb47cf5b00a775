# Gives a target folders of its own, searched first, that are named as the rooms are and hold headers that do not compile.
function(own_folders target)
  foreach(header IN ITEMS index/error.h index/errors.h index/text.h device/haptic_device.h solver/frames.h viewer/scene/camera.h)
    file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/own/${header}" "#error \"the consumer's own ${header}\"\n")
  endforeach()
  target_include_directories(${target} BEFORE PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/own")
endfunction()
