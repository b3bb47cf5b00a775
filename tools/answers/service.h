// Service: what the routes answer from; Call: one request to a route. Thread rule: see the members.
#pragma once

#include "tools/answers/access.h"
#include "tools/answers/answer.h"
#include "tools/answers/metrics.h"
#include "tools/answers/request.h"
#include "tools/answers/set_shelf.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

struct Service {
  SetShelf& shelf;
  const Access& access;
  Metrics& metrics;
  std::string version = {};
};

struct Call {
  const Service& service;
  const Request& request;
  std::vector<std::string> captured;             // what the {} of the route's path stand for, decoded
  std::shared_ptr<const ServedSet> served = {};  // the set that the path names, if it names one
};

// True if the request's Accept asks for an .npy array.
bool wantsNpy(const Request& request);

// The answers. Each throws Refusal, UsageError for a wrong value, and what the set throws. Routes turns these into
// problems. tools/serve/README.md says what each answers.
Answer pageAnswer(const Call& call);
Answer styleAnswer(const Call& call);
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
Answer sessionAnswer(const Call& call);

}  // namespace filiform::tools
