#include "viewer/window/panels/internal/contact_view.h"

#include "index/contacts/contacts.h"
#include "viewer/window/panels/internal/background_work.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kMemory_bytes = 64 << 20;

ContactView::Side sideOf(const ContactSite::Side& side) {
  return {side.cell, {side.segment, side.t, side.child, side.parent}, side.type};
}

}  // namespace

void ContactView::find(std::uint32_t cell, double within_um) {
  close();
  cell_ = cell;
  finding_ = std::make_shared<Finding>();
  if (!worker_) worker_ = std::make_unique<Worker>();
  worker_->ask([this, now = finding_, cell, within_um]() -> Worker::Done {
    lowerPriority();
    std::vector<Site> sites;
    std::string error;
    try {
      ContactOptions options{.within_um = within_um, .from = {cell}, .detail = ContactOptions::Detail::kSites};
      options.to = presentCells(store_, now->stop);
      std::erase(options.to, cell);
      options.memory_bytes = kMemory_bytes;
      options.check = [&](std::uint64_t done, std::uint64_t tiles) {
        if (now->stop) throw Stopped();
        now->part = static_cast<double>(done) / static_cast<double>(std::max<std::uint64_t>(tiles, 1));
      };
      const std::shared_ptr<const CellWalk> walk = finder_.walk(cell, &now->stop);
      findContacts(store_, options, [&](const ContactSite& site) {
        const Side own = sideOf(site.sides[0]);
        sites.push_back({own, sideOf(site.sides[1]), walk->position_W(own.place), site.distance_um});
      });
      std::stable_sort(sites.begin(), sites.end(),
                       [](const Site& a, const Site& b) { return a.distance_um < b.distance_um; });
    } catch (const Stopped&) {
      return {};
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    return [this, now, sites = std::move(sites), error = std::move(error)] {
      if (finding_ != now) return;
      finding_.reset();
      sites_ = sites;
      error_ = error;
      if (sites_.empty()) return;
      std::vector<Vector3d> marks_W;
      for (std::size_t i = 0; i < std::min(sites_.size(), kMostMarks); ++i) marks_W.push_back(sites_[i].p_W);
      marks_W_ = std::make_shared<const std::vector<Vector3d>>(std::move(marks_W));
    };
  });
}

void ContactView::close() {
  if (finding_) finding_->stop = true;
  finding_.reset();
  cell_.reset();
  sites_.clear();
  marks_W_.reset();
  error_.clear();
}

void ContactView::serve() {
  if (worker_) worker_->serve([](const std::string&) {});
}

std::optional<double> ContactView::progress() const {
  if (finding_ == nullptr) return std::nullopt;
  return finding_->part.load();
}

const ContactView::Site* ContactView::nearest(std::uint32_t cell, const Vector3d& p_W) const {
  const Site* found = nullptr;
  double least = 0;
  for (const Site& site : sites_) {
    if (site.own.cell != cell && site.other.cell != cell) continue;
    const double squared = (site.p_W - p_W).squaredNorm();
    if (found == nullptr || squared < least) found = &site, least = squared;
  }
  return found;
}

void ContactView::describe(nlohmann::ordered_json& json) const {
  json["contacts"] = sites_.size();
  json["contacts_error"] = error_;
  if (cell_) json["contacts_of"] = *cell_;
  json["contacts_under_way"] = finding_ != nullptr;
}

}  // namespace filiform::internal
