// The answer of the route picture.
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"
#include "tools/serve/sets/picture_maker.h"

namespace filiform::tools {

Answer pictureAnswer(const Call& call) {
  if (call.service.pictures == nullptr) throw Refusal(501, "this server draws no pictures (--no-pictures)");
  const std::string camera = call.request.parameter("camera").value_or("");
  const PictureSize size =
      parseSize("size", call.request.parameter("size").value_or("640x400"), PictureMaker::kMostSide);
  return {.type = "image/png", .body = *call.service.pictures->draw(call.served, camera, size, limits::kQuery_s)};
}

}  // namespace filiform::tools
