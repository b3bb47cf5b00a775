// The paper's three scenes as the evaluation travels them, and the paper's own figures. Functions without state.
//
// The paper describes its scenes in words. Scene 1 is one path without branches. Scenes 2 and 3 are two paths through
// one branching structure; the path of scene 3 has more complex branching. Ours (tools/synthetic/synthetic.h) were
// built to this text and to the paper's Figures 2 and 3 before any method was run on them.
#pragma once

#include "tools/lab/evaluate/trials/trial_corpus.h"

#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

// One cell with one route for each kind (tools/synthetic/synthetic.h), in this order; none: for each of sceneKinds().
// The kind is the cell's source. Throws UsageError for a kind that is no scene.
std::vector<CorpusCell> evaluationScenes(std::vector<std::string> kinds = {});
// "scene 1", "hooks".
std::string sceneTitle(const CorpusCell& scene);

struct PaperFigures {  // Raya et al. 2011, Tables 1 and 2; measured on a Core i5 at 3.2 GHz, with a person's hand
  double tick_us, segments, force_integral_Ns, mean_force_N;
};
// `scene` counts from 1. Returns nullopt if the paper gives no figures: other scenes, methods that the paper does not
// have, and basic on scene 3, which is not completed.
std::optional<PaperFigures> paperFigures(int scene, const std::string& method);

}  // namespace filiform::tools
