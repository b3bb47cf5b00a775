// Service: what the routes answer from; Call: one request to a route. Thread rule: see the members.
#pragma once

#include "tools/serve/routes/access.h"
#include "tools/serve/routes/request.h"
#include "tools/serve/sets/metrics.h"
#include "tools/serve/sets/set_shelf.h"
#include "tools/words/answer.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

class PictureMaker;

struct Service {
  SetShelf& shelf;
  Access& access;
  Metrics& metrics;
  std::string version = {};
  PictureMaker* pictures = nullptr;  // nullptr: the server draws no pictures
  std::string source_url = {};       // of the program's source, for the page; empty: not stated
  std::string neuroglancer = {};     // address of a Neuroglancer, for links on the page; empty: no links
  std::string web_folder = {};       // with the files of the page for travel; empty: they are not built
};

struct Call {
  const Service& service;
  const Request& request;
  std::vector<std::string> captured;             // what the {} of the route's path stand for, decoded
  std::shared_ptr<const ServedSet> served = {};  // the set that the path names, if it names one

  // The open sets that the person who asks may know of.
  std::vector<std::shared_ptr<const ServedSet>> sets() const { return service.shelf.all(request.person.get()); }
};

// True if the request's Accept asks for an .npy array.
bool wantsNpy(const Request& request);

// Throws Refusal (413) if the cell has more samples than an answer may hold.
void refuseLargeCell(const CellRecord& cell);

// The cell with this name. A part of a name is enough, as in the program; in a set too large to compare all names, the
// whole name is needed. Throws Refusal (404).
std::uint32_t cellLike(const ServedSet& served, const std::string& name, const std::string& parameter);

// The cells that meet `conditions`, which `;` parts. Throws Refusal (400; 413 for a set with many cells, and if many
// samples would be measured), AnswerTimeout.
std::vector<std::uint32_t> cellsMeeting(const ServedSet& served, const std::string& conditions);

// Calls use() for each cell that the parameters `name` and `where` choose, from `cursor` on, until use() returns false,
// or kScannedCells are compared. Returns the cursor of the first cell that is left; nullopt: none. Throws as
// cursorOf().
std::optional<std::string> eachListedCell(const Call& call,
                                          const std::function<bool(std::uint32_t, const CellRecord&)>& use);

// Answers a request with a token in its address: a cookie instead, and a redirect to `page` with the other parameters.
Answer tokenAnswer(const Call& call, const std::string& page);

// The answers. Each throws Refusal, UsageError for a wrong value, and what the set throws. Routes turns these into
// problems. tools/serve/README.md says what each answers.
Answer pageAnswer(const Call& call);
Answer styleAnswer(const Call& call);
Answer scriptAnswer(const Call& call);
Answer healthAnswer(const Call& call);
Answer readinessAnswer(const Call& call);
Answer metricsAnswer(const Call& call);
Answer openapiAnswer(const Call& call);
Answer setsAnswer(const Call& call);
Answer setAnswer(const Call& call);
Answer fileAnswer(const Call& call);
Answer nearestAnswer(const Call& call);
Answer boxAnswer(const Call& call);
Answer rayAnswer(const Call& call);
Answer pathAnswer(const Call& call);
Answer cellsAnswer(const Call& call);
Answer cellAnswer(const Call& call);
Answer measuresAnswer(const Call& call);
Answer contactsAnswer(const Call& call);
Answer densityAnswer(const Call& call);
Answer sessionAnswer(const Call& call);
Answer deskAnswer(const Call& call);
Answer pictureAnswer(const Call& call);
Answer iconAnswer(const Call& call);
Answer travelAnswer(const Call& call);
Answer travelFileAnswer(const Call& call);
Answer capabilityAnswer(const Call& call);
Answer precomputedInfoAnswer(const Call& call);
Answer precomputedPropertiesAnswer(const Call& call);
Answer precomputedSkeletonAnswer(const Call& call);
Answer catmaidTokenAnswer(const Call& call);
Answer catmaidVersionAnswer(const Call& call);
Answer catmaidStacksAnswer(const Call& call);
Answer catmaidStackAnswer(const Call& call);
Answer catmaidSkeletonsAnswer(const Call& call);
Answer catmaidNodesAnswer(const Call& call);
Answer catmaidSkeletonAnswer(const Call& call);
Answer catmaidRootAnswer(const Call& call);

}  // namespace filiform::tools
