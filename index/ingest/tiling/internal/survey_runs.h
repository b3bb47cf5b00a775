// Joins surveys of neighbouring ranges of keys, in any order of arrival. Neighbours are joined at once, so that few
// wait. Thread rule: thread-compatible.
#pragma once

#include "index/ingest/tiling/landmarks.h"

#include <cstddef>
#include <iterator>
#include <map>
#include <utility>

namespace filiform::internal {

class SurveyRuns {
 public:
  // Adds the survey of range number `place`; each once.
  void add(std::size_t place, LandmarkSurvey survey) {
    const auto at = runs_.emplace(place, Run{place + 1, std::move(survey)}).first;
    if (const auto next = std::next(at); next != runs_.end() && next->first == at->second.end) join(at, next);
    if (at == runs_.begin()) return;
    if (const auto before = std::prev(at); before->second.end == place) join(before, at);
  }
  // Adds them to the survey of what comes before.
  void addTo(LandmarkSurvey& all) const {
    for (const auto& [begin, run] : runs_) all.add(run.survey);
  }

 private:
  struct Run {
    std::size_t end;
    LandmarkSurvey survey;
  };
  using Runs = std::map<std::size_t, Run>;
  void join(Runs::iterator before, Runs::iterator next) {
    before->second.survey.add(next->second.survey);
    before->second.end = next->second.end;
    runs_.erase(next);
  }
  Runs runs_;
};

}  // namespace filiform::internal
