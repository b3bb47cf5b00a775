// The paper's three scenes, as the evaluation travels them, and the paper's own figures. Functions without state.
//
// The paper describes them in words: 1 is one path without branches, with concave elbows; 2 and 3 are an easy and a
// hard path through one branching structure. Ours (tools/synthetic.h) were built to those words before any method was
// run.
#pragma once

#include "tools/evaluate/trial_corpus.h"

#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

// "scene1", "scene2", "scene3": one cell each, with its one route.
std::vector<CorpusCell> evaluationScenes();

struct PaperFigures {  // Raya et al. 2011, Tables 1 and 2; measured on a Core i5 at 3.2 GHz, with a person's hand
  double tick_us, segments, force_integral_Ns, mean_force_N;
};
// None where the paper gives none: methods that it does not have, and basic on scene 3, which it does not complete.
std::optional<PaperFigures> paperFigures(int scene, const std::string& method);

}  // namespace filiform::tools
