#include "tools/synthetic/synthetic_neuron.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::size_t kNoLimit = SIZE_MAX;
constexpr std::uint16_t kSoma = 1, kAxon = 2, kBasal = 3, kApical = 4;

const Vector3d kUp(0, 1, 0);
const Vector3d kDown(0, -1, 0);

// Depths below the pia at which layers L1 to L6 begin, and the share of the cells in each layer.
constexpr std::array<double, 7> kLayerDepth_um{0, 130, 250, 420, 600, 950, kColumnHeight_um};
constexpr std::array<double, 6> kLayerShare{0.02, 0.10, 0.17, 0.19, 0.22, 0.30};

double layerTop_um(int layer) { return kColumnHeight_um - kLayerDepth_um[static_cast<std::size_t>(layer - 1)]; }

// Growth parameters of one kind of neurite. Lengths are means over sections; actual lengths vary by +-50 %.
struct Style {
  std::uint16_t type = kBasal;
  double first_um = 18, inner_um = 30, last_um = 100;
  double branching = 1.3;  // chance that a section branches, less `branching_loss` for each order
  double branching_loss = 0.35;
  double wander = 0.09;              // deviation of the direction after 1 um
  double outward = 0.012;            // pull away from the soma, per um
  Vector3d pull = Vector3d::Zero();  // pull along a fixed direction, per um
  double reach_um = 1e9;             // beyond this distance from `centre` the tree turns back
  Vector3d centre = Vector3d::Zero();
  double spread = 0.6;  // tangent of half the angle between daughters
  double least_radius_um = 0.2;
  int most_orders = 12;
};

class Grower {
 public:
  Grower(Neuron& neuron, SyntheticRandom& random, const Vector3d& soma_um, double soma_radius_um)
      : neuron_(neuron), random_(random), soma_(soma_um), soma_radius_(soma_radius_um) {
    add(kSoma, soma_, soma_radius_, kNoParent);
    add(kSoma, soma_ - soma_radius_ * kUp, soma_radius_, 0);
    add(kSoma, soma_ + soma_radius_ * kUp, soma_radius_, 0);
  }

  struct End {
    std::uint32_t sample;
    Vector3d p, direction;
    double radius_um;
  };

  End stem(std::uint16_t type, const Vector3d& direction, double radius_um) {
    const Vector3d p = soma_ + soma_radius_ * direction;
    return {add(type, p, radius_um, 0), p, direction, radius_um};
  }

  // Grows one unbranched run. The radius falls evenly to `to_radius_um`.
  End section(const Style& style, End from, double length_um, double to_radius_um) {
    const double from_radius_um = from.radius_um;
    for (double done = 0; done < length_um;) {
      const double u = random_.uniform();
      // Mean 2.4 um. The last step is stretched, so that no short stub remains.
      double step = 1 + 5 * u * u * std::sqrt(u);
      if (length_um - done - step < 1) step = std::clamp(length_um - done, 1.0, 6.0);
      steer(style, from, step);
      from.p += step * from.direction;
      done += step;
      const double t = std::min(1.0, done / length_um);
      from.radius_um = from_radius_um + (to_radius_um - from_radius_um) * t;
      from.sample = add(style.type, from.p, from.radius_um, from.sample);
    }
    return from;
  }

  // Grows a whole tree. It ends early, with the twigs already begun, when the neuron has `most_samples`.
  void tree(const Style& style, const End& root, int order, std::size_t most_samples) {
    std::vector<std::pair<End, int>> todo{{root, order}};
    while (!todo.empty() && neuron_.samples.size() < most_samples) {
      auto [end, level] = todo.back();
      todo.pop_back();
      const bool branches =
          level < style.most_orders && random_.uniform() < style.branching - style.branching_loss * level;
      const double mean_um = !branches ? style.last_um : level == 0 ? style.first_um : style.inner_um;
      const double thin = std::max(style.least_radius_um, end.radius_um * (branches ? 0.92 : 0.55));
      end = section(style, end, mean_um * random_.between(0.5, 1.5), thin);
      if (!branches) continue;
      for (const End& daughter : fork(style, end)) todo.emplace_back(daughter, level + 1);
    }
  }

  // Starts a twig that leaves a neurite sideways, tilted by `tilt` along `axis` (0: at a right angle).
  End sideways(const End& from, double tilt, double radius_um) {
    End twig = from;
    twig.direction = (across(from.direction) + tilt * kUp).normalized();
    twig.radius_um = radius_um;
    return twig;
  }

  std::array<End, 2> fork(const Style& style, const End& end) {
    const Vector3d side = across(end.direction);
    // Rall: the parent's radius^1.5 is the sum of the daughters' radius^1.5; 0.63 each if they are equal.
    const double tilt = random_.between(-0.08, 0.08);
    std::array<End, 2> out{end, end};
    for (int i = 0; i < 2; ++i) {
      const double sign = i == 0 ? 1 : -1;
      End& daughter = out[static_cast<std::size_t>(i)];
      daughter.direction = (end.direction + sign * style.spread * random_.between(0.6, 1.4) * side).normalized();
      daughter.radius_um = std::max(style.least_radius_um, end.radius_um * (0.66 + sign * tilt));
    }
    return out;
  }

  // Returns `count` directions. Each is the best of several candidates: far from the other directions and from `taken`.
  // None rises above `highest`.
  std::vector<Vector3d> balanced(int count, std::vector<Vector3d> taken, double highest) {
    std::vector<Vector3d> out;
    for (int i = 0; i < count; ++i) {
      Vector3d best = kDown;
      double best_nearness = 2;
      for (int candidate = 0; candidate < 24; ++candidate) {
        const Vector3d d = random_.direction();
        if (d.y() > highest) continue;
        double nearness = -1;
        for (const Vector3d& other : taken) nearness = std::max(nearness, d.dot(other));
        if (nearness < best_nearness) {
          best_nearness = nearness;
          best = d;
        }
      }
      out.push_back(best);
      taken.push_back(best);
    }
    return out;
  }

  std::size_t size() const { return neuron_.samples.size(); }
  const Vector3d& soma() const { return soma_; }
  SyntheticRandom& random() { return random_; }

 private:
  std::uint32_t add(std::uint16_t type, const Vector3d& p, double radius_um, std::uint32_t parent) {
    NeuronSample sample;
    for (int i = 0; i < 3; ++i) sample.p_nm[static_cast<std::size_t>(i)] = std::llround(p[i] * 1000);
    sample.radius_nm = std::llround(radius_um * 1000);
    sample.parent = parent;
    sample.type = type;
    neuron_.samples.push_back(sample);
    return static_cast<std::uint32_t>(neuron_.samples.size() - 1);
  }

  Vector3d across(const Vector3d& direction) {
    for (;;) {
      const Vector3d d = random_.direction();
      const Vector3d side = d - d.dot(direction) * direction;
      if (side.squaredNorm() > 0.05) return side.normalized();
    }
  }

  void steer(const Style& style, End& end, double step) {
    Vector3d d = end.direction;
    const double noise = style.wander * std::sqrt(step);
    d += noise * Vector3d(random_.gaussian(), random_.gaussian(), random_.gaussian());
    d += step * style.pull;
    const Vector3d from_soma = end.p - soma_;
    d += step * style.outward * from_soma / std::max(1.0, from_soma.norm());
    const Vector3d from_centre = end.p - style.centre;
    if (const double distance = from_centre.norm(); distance > style.reach_um)
      d -= 0.035 * step * from_centre / distance;
    // The pia is a wall: neurites bend along it and then away from it.
    const double headroom_um = kColumnHeight_um - 4 - end.p.y();
    if (headroom_um < 40 && d.y() > 0) d.y() *= std::max(0.0, headroom_um - 4) / 40;
    if (headroom_um < 25) d.y() -= 0.02 * step;
    if (headroom_um < 4) d.y() -= 0.3;
    end.direction = d.normalized();
  }

  Neuron& neuron_;
  SyntheticRandom& random_;
  Vector3d soma_;
  double soma_radius_;
};

void growBasal(Grower& g, int stems, double last_um, double radius_um, double highest, std::vector<Vector3d> taken) {
  Style style;
  style.last_um = last_um;
  for (const Vector3d& direction : g.balanced(stems, std::move(taken), highest))
    g.tree(style, g.stem(kBasal, direction, radius_um * g.random().between(0.85, 1.15)), 0, kNoLimit);
}

// Grows a trunk from the top of the soma to `tuft_y_um`, obliques on its lower part, and a tuft above it unless
// `tuft_orders` is 0.
void growApical(Grower& g, double tuft_y_um, double top_y_um, double radius_um, int obliques, int tuft_orders) {
  Style trunk;
  trunk.type = kApical;
  trunk.wander = 0.035;
  trunk.outward = 0;
  trunk.pull = 0.04 * kUp;
  Style oblique;
  oblique.type = kApical;
  oblique.branching = 0.75;
  oblique.branching_loss = 0.4;
  oblique.inner_um = 35;
  oblique.last_um = 90;
  Style tuft = oblique;
  tuft.branching = 1.4;
  tuft.branching_loss = 1.4 / (tuft_orders + 1);
  tuft.first_um = 25;
  tuft.inner_um = 40;
  tuft.last_um = std::max(60.0, (top_y_um - tuft_y_um) * 0.6);
  tuft.outward = 0.003;
  tuft.pull = 0.008 * kUp;
  tuft.spread = 0.75;

  Grower::End end = g.stem(kApical, (kUp + 0.08 * g.random().direction()).normalized(), radius_um);
  const double length_um = std::max(20.0, tuft_y_um - end.p.y());
  std::vector<Grower::End> twigs;
  double done = 0;
  for (int i = 0; i <= obliques; ++i) {
    // Obliques crowd on the lower two thirds of the trunk.
    const double until =
        i == obliques ? length_um : 12 + (length_um * 0.65 - 12) * (i + g.random().uniform()) / obliques;
    // A short trunk has room for fewer obliques.
    if (until < done + 2) continue;
    end = g.section(trunk, end, until - done, radius_um * (1 - 0.55 * until / length_um));
    done = until;
    if (i < obliques) twigs.push_back(end);
  }
  if (tuft_orders > 0)
    for (const Grower::End& daughter : g.fork(tuft, end)) g.tree(tuft, daughter, 1, kNoLimit);
  for (const Grower::End& twig : twigs)
    g.tree(oblique, g.sideways(twig, 0.25, std::max(0.3, twig.radius_um * 0.4)), 0, kNoLimit);
}

// Grows an axon down into the white matter, with collaterals until the neuron has `size` samples.
void growProjectionAxon(Grower& g, std::size_t size) {
  SyntheticRandom& random = g.random();
  Style main;
  main.type = kAxon;
  main.wander = 0.03;
  main.outward = 0;
  main.pull = 0.03 * kDown;
  Style collateral;
  collateral.type = kAxon;
  collateral.first_um = 60;
  collateral.inner_um = 80;
  collateral.last_um = 150;
  collateral.branching = 0.95;
  collateral.branching_loss = 0.17;
  collateral.wander = 0.055;
  collateral.outward = 0.002;
  collateral.spread = 0.7;
  collateral.least_radius_um = 0.15;
  collateral.centre = g.soma();
  collateral.reach_um = 260;

  Grower::End end = g.stem(kAxon, (kDown + 0.15 * random.direction()).normalized(), 0.7);
  std::vector<Grower::End> sites;
  const double goal_y_um = -random.between(40, 90);
  while (end.p.y() > goal_y_um) {
    end = g.section(main, end, random.between(25, 60), std::max(0.35, end.radius_um * 0.95));
    const double below_um = g.soma().y() - end.p.y();
    if (below_um > 25 && below_um < 520 && end.p.y() > 20) sites.push_back(end);
  }
  while (g.size() < size && !sites.empty()) {
    const auto pick = static_cast<std::size_t>(random.uniform() * static_cast<double>(sites.size()));
    const Grower::End site = sites[pick];
    // One in four collaterals climbs back to the upper layers.
    const bool recurrent = random.uniform() < 0.25;
    collateral.pull = (recurrent ? 0.02 : 0.0) * kUp;
    collateral.reach_um = recurrent ? 420 : 260;
    Grower::End twig = g.sideways(site, recurrent ? 0.9 : random.between(-0.4, 0.3), 0.3);
    if (sites.size() > 4) {
      sites.erase(sites.begin() + static_cast<std::ptrdiff_t>(pick));
    } else {
      // Two collaterals never share a point: the next one leaves from this one.
      twig = g.section(collateral, twig, random.between(20, 50), 0.3);
      sites[pick] = twig;
    }
    g.tree(collateral, twig, 0, size);
  }
}

// Grows a dense arbour within `reach_um` of `centre`, connected to the soma.
void growLocalAxon(Grower& g, std::size_t size, const Vector3d& towards, const Vector3d& centre, double reach_um) {
  Style trunk;
  trunk.type = kAxon;
  trunk.wander = 0.05;
  trunk.outward = 0;
  Style arbour;
  arbour.type = kAxon;
  arbour.first_um = 30;
  arbour.inner_um = 45;
  arbour.last_um = 60;
  arbour.branching = 1.0;
  arbour.branching_loss = 0.06;
  arbour.most_orders = 14;
  arbour.wander = 0.11;
  arbour.outward = 0;
  arbour.spread = 0.8;
  arbour.least_radius_um = 0.15;
  arbour.centre = centre;
  arbour.reach_um = reach_um;

  Grower::End end = g.stem(kAxon, towards, 0.5);
  std::vector<Grower::End> sites;
  do {
    const Vector3d way = centre - end.p;
    const double distance = way.norm();
    if (distance > 40) trunk.pull = 0.05 * way / distance;
    end = g.section(trunk, end, 30, 0.35);
    sites.push_back(end);
  } while ((centre - end.p).norm() > 40 && sites.size() < 60);
  g.tree(arbour, end, 0, size);
  const std::size_t last = std::min<std::size_t>(sites.size(), 6);
  for (std::size_t i = 0; g.size() < size && i < 200; ++i) {
    Grower::End& site = sites[sites.size() - 1 - i % last];
    site = g.section(arbour, g.sideways(site, 0.0, 0.3), 12, 0.3);
    g.tree(arbour, site, 1, size);
  }
}

struct NeuronPlan {
  const char* kind;
  double share;    // fraction of the cells of its layer
  double samples;  // typical size
  double soma_radius_um;
};

const std::vector<NeuronPlan>& plansOfLayer(int layer) {
  static const std::array<std::vector<NeuronPlan>, 6> kPlans{{
      {{"neurogliaform", 1, 2600, 5}},
      {{"pyramidal", 0.84, 3600, 6.5}, {"basket", 0.16, 3600, 5.5}},
      {{"pyramidal", 0.82, 4200, 7}, {"basket", 0.10, 4000, 5.5}, {"Martinotti", 0.08, 4200, 5.5}},
      {{"spiny stellate", 0.55, 3300, 6}, {"star pyramidal", 0.33, 3700, 6.5}, {"basket", 0.12, 4000, 5.5}},
      {{"thick-tufted pyramidal", 0.45, 6800, 9},
       {"slender-tufted pyramidal", 0.37, 5000, 8},
       {"basket", 0.10, 4200, 6},
       {"Martinotti", 0.08, 4800, 6}},
      {{"pyramidal", 0.88, 3800, 7}, {"basket", 0.12, 3800, 5.5}},
  }};
  return kPlans[static_cast<std::size_t>(layer - 1)];
}

void growKind(Grower& g, const std::string& kind, int layer, std::size_t size) {
  SyntheticRandom& random = g.random();
  // A stem with its twigs has about 2 samples for each um of twig length. Larger cells therefore get more stems.
  const auto stems = [&](int least, int most, double share, double last_um) {
    const double wanted = static_cast<double>(size) * share / (2.1 * last_um) * random.between(0.85, 1.15);
    return std::clamp(static_cast<int>(std::lround(wanted)), least, most);
  };
  if (kind.find("pyramidal") != std::string::npos) {
    const bool thick = kind.starts_with("thick");
    if (kind.starts_with("star")) {
      growApical(g, layerTop_um(3) + random.between(-90, -10), layerTop_um(2), 1.1, 4, 0);
    } else if (layer == 6) {
      growApical(g, layerTop_um(4) + random.between(-120, -40), layerTop_um(4), 1.2, 6, 2);
    } else {
      const double top = kColumnHeight_um - 10;
      const double base = std::max(g.soma().y() + 25, layerTop_um(2) - random.between(0, 80));
      growApical(g, base, top, thick ? 2.8 : 1.5, thick ? 10 : layer == 5 ? 7 : 4, thick ? 4 : layer == 5 ? 2 : 3);
    }
    const double last_um = thick ? 120 : 95;
    growBasal(g, stems(3, 7, 0.3, last_um), last_um, thick ? 1.2 : 0.9, 0.3, {kUp, kDown});
    growProjectionAxon(g, std::max(size, g.size() + 700));
  } else if (kind == "spiny stellate") {
    growBasal(g, stems(5, 8, 0.42, 80), 80, 0.8, 1, {kDown});
    growProjectionAxon(g, std::max(size, g.size() + 700));
  } else if (kind == "Martinotti") {
    growBasal(g, stems(4, 6, 0.3, 85), 85, 0.7, 0.6, {kUp});
    const Vector3d in_l1(g.soma().x() + random.between(-40, 40), kColumnHeight_um - 70,
                         g.soma().z() + random.between(-40, 40));
    growLocalAxon(g, std::max(size, g.size() + 700), kUp, in_l1, 110);
  } else {
    const bool gliaform = kind == "neurogliaform";
    const double last_um = gliaform ? 45 : 85;
    growBasal(g, gliaform ? stems(6, 9, 0.3, 45) : stems(4, 6, 0.3, 85), last_um, 0.7, 1, {});
    growLocalAxon(g, std::max(size, g.size() + 700), random.direction(),
                  g.soma() + (gliaform ? 10 : 25) * random.direction(), gliaform ? 90 : 130);
  }
}

std::uint64_t splitMix(std::uint64_t& x) {
  x += 0x9e3779b97f4a7c15U;
  std::uint64_t z = x;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

}  // namespace

SyntheticRandom::SyntheticRandom(std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t x = seed;
  x = splitMix(x) ^ (stream * 0xd1342543de82ef95U + 1);
  for (std::uint64_t& word : state_) word = splitMix(x);
}

std::uint64_t SyntheticRandom::bits() {
  auto& s = state_;
  const std::uint64_t result = std::rotl(s[0] + s[3], 23) + s[0];
  const std::uint64_t t = s[1] << 17;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= t;
  s[3] = std::rotl(s[3], 45);
  return result;
}

double SyntheticRandom::uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

double SyntheticRandom::gaussian() {
  // The sum of eight uniforms has variance 8/12; each 64-bit draw gives two of 32 bits.
  double sum = -4;
  for (int i = 0; i < 4; ++i) {
    const std::uint64_t b = bits();
    sum += (static_cast<double>(b >> 32) + static_cast<double>(b & 0xffffffffU)) * 0x1p-32;
  }
  return sum * 1.224744871391589;
}

Vector3d SyntheticRandom::direction() {
  for (;;) {
    const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
    const double square = x * x + y * y + z * z;
    if (square > 1e-4 && square <= 1) return Vector3d(x, y, z) / std::sqrt(square);
  }
}

Vector3d SyntheticRandom::inDisc() {
  for (;;) {
    const double x = between(-1, 1), z = between(-1, 1);
    if (x * x + z * z <= 1) return {x, 0, z};
  }
}

int layerOfCell(std::uint64_t seed, std::uint64_t number) {
  std::uint64_t x = seed;
  // A golden-ratio sequence fills the layers evenly for any number of cells.
  const double start = static_cast<double>(splitMix(x) >> 11) * 0x1p-53;
  const double step = static_cast<double>((number * 0x9e3779b97f4a7c15U) >> 11) * 0x1p-53;
  double u = start + step;
  if (u >= 1) u -= 1;
  int layer = 1;
  for (double sum = kLayerShare[0]; layer < 6 && u >= sum; ++layer) sum += kLayerShare[static_cast<std::size_t>(layer)];
  return layer;
}

Neuron growNeuron(std::uint64_t seed, std::uint64_t number, bool on_axis) {
  SyntheticRandom random(seed, number);
  const int layer = layerOfCell(seed, number);
  const std::vector<NeuronPlan>& plans = plansOfLayer(layer);
  double u = random.uniform();
  std::size_t chosen = 0;
  for (; chosen + 1 < plans.size() && u >= plans[chosen].share; ++chosen) u -= plans[chosen].share;
  const NeuronPlan& plan = plans[chosen];

  Neuron neuron;
  neuron.description = std::string(plan.kind) + " cell, layer L" + std::to_string(layer);
  const Vector3d across = kColumnRadius_um * random.inDisc();
  const double top_um = layerTop_um(layer) - 12;
  const double bottom_um = layerTop_um(layer + 1) + 12;
  const double y_um = layer == 6 ? random.between(110, top_um) : random.between(bottom_um, top_um);
  const Vector3d soma(on_axis ? 0 : across.x(), y_um, on_axis ? 0 : across.z());
  // Sizes are skewed: most cells are near the typical size, a few are much larger.
  const double v = random.uniform();
  auto size = static_cast<std::size_t>(plan.samples * (0.62 + 0.62 * v + 0.45 * v * v * v * v));
  if (on_axis) size = size * 29 / 20;
  neuron.samples.reserve(size + 200);
  Grower grower(neuron, random, soma, plan.soma_radius_um * random.between(0.88, 1.15));
  growKind(grower, plan.kind, layer, size);
  return neuron;
}

}  // namespace filiform::tools
