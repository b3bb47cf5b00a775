#include "tools/commands/shared/follow.h"

#include "index/errors.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/commands/shared/scene.h"
#include "tools/serve/desk/desk_link.h"

#include <iostream>

namespace filiform::tools {

namespace {

DeskPlace::Point deskPoint(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

DeskPlace deskPlaceOf(const NavigationSnapshot& now) {
  const Eigen::Quaterniond& turn = now.rotation_WD;
  return {.proxy_W = deskPoint(now.p_W),
          .hand_W = deskPoint(now.h_W),
          .centre_W = deskPoint(now.centre_W),
          .rotation_WD = {turn.w(), turn.x(), turn.y(), turn.z()},
          .zoom_um = now.zoom_um,
          .force_N = now.force_N.norm(),
          .constrained = now.mode == NavigationMode::constrained};
}

// A token is for the host of the set. Of a set in a folder, it is for the server of the page.
std::string tokenFor(const DeskAddress& address, const std::string& set, const std::string& token) {
  if (!isAddress(set)) return token;
  const std::size_t begin = set.find("://") + 3;
  return set.substr(begin, set.find('/', begin) - begin) == address.authority() ? token : "";
}

}  // namespace

struct Follow::Impl {
  DeskLink link;
};

Follow::Follow(const std::string& text, const std::vector<std::string>& scene, const std::string& token) {
  const DeskAddress address = DeskAddress::parse(text);
  if (scene.size() != 1 || isFileScene(scene.front()))
    throw UsageError("--follow takes one tile set; name the set that the page shows");
  impl_.reset(new Impl{DeskLink(address, tokenFor(address, scene.front(), token))});
}

Follow::~Follow() = default;

std::vector<std::string> Follow::observe(const OpenedScene& scene, const NavigationSnapshot& now) {
  if (now.tick > 0) impl_->link.show(scene.revision, deskPlaceOf(now));
  std::vector<std::string> notes = impl_->link.takeNotes();
  for (const std::string& note : notes) std::cerr << "filiform: note: " + note + '\n';
  return notes;
}

void Follow::throwIfRefused() const {
  if (const auto why = impl_->link.refusal()) throw UsageError("--follow " + *why);
}

}  // namespace filiform::tools
