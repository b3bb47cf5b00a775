// Made-up sequences of calls of filiform.h: handles that are null, closed or of another kind, values of any bytes,
// structs of any size. Only the status and the promises of the header count.
#include "tests/fuzz/c_interface_fuzzer.h"

#include "tests/fuzz/fuzz_bytes.h"
#include "tools/c/filiform.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace filiform::fuzz {

namespace {

constexpr std::size_t kHandles = 4, kMostHits = 16, kMostCalls = 64;
constexpr std::uint64_t kMostTicks = 40;

int stopSoon(void*, const filiform_run_tick* tick) { return tick->tick >= kMostTicks; }
int cancelSoon(void* calls, const char*, std::uint64_t, std::uint64_t) { return ++*static_cast<int*>(calls) > 3; }

class Sequence {
 public:
  Sequence(Input input, const CallFiles& files) : bytes_(input), files_(files) {}
  ~Sequence() {
    for (filiform_set* set : sets_) filiform_close(set);
    for (filiform_cell* cell : cells_) filiform_cell_close(cell);
    for (filiform_travel* travel : travels_) filiform_travel_close(travel);
  }
  Sequence(const Sequence&) = delete;
  Sequence& operator=(const Sequence&) = delete;

  void run() {
    for (std::size_t calls = 0; calls < kMostCalls && !bytes_.empty(); ++calls) one();
  }

 private:
  std::uint8_t byte() { return bytes_.number<std::uint8_t>(); }
  // Often a place in the data, sometimes any bits.
  double number() {
    const std::uint8_t kind = byte();
    return kind < 16 ? bytes_.number<double>() : static_cast<double>(kind) - 128.0;
  }
  std::array<double, 3> point() { return {number(), number(), number()}; }
  template <class T>
  T sizedStruct() {
    T value{};
    value.struct_size = byte() < 8 ? bytes_.number<std::uint32_t>() : sizeof(T);
    return value;
  }
  template <class T>
  T* handleOf(std::array<T*, kHandles>& handles) {
    return handles[byte() % kHandles];
  }
  // A handle of any kind.
  template <class T>
  T* anyHandle(std::array<T*, kHandles>& handles) {
    if (byte() >= 8) return handleOf(handles);
    switch (byte() % 3) {
      case 0:
        return reinterpret_cast<T*>(handleOf(sets_));
      case 1:
        return reinterpret_cast<T*>(handleOf(cells_));
      default:
        return reinterpret_cast<T*>(bytes_.number<std::uintptr_t>());
    }
  }

  static int told(int status) {
    require(status >= FILIFORM_OK && status < FILIFORM_INTERNAL, "no call ends with an internal error");
    require(status == FILIFORM_OK || *filiform_error_text() != '\0', "a failure has a text");
    return status;
  }
  static void freeHits(int status, filiform_hit* hits, std::size_t count) {
    require((hits == nullptr) == (count == 0), "an empty array is NULL");
    require(status == FILIFORM_OK || hits == nullptr, "a failure gives no array");
    for (std::size_t i = 0; i < count; ++i) require(hits[i].t >= 0 && hits[i].t <= 1, "t is on the segment");
    filiform_free(hits);
  }

  void one() {
    switch (byte() % 8) {
      case 0:
        return openAndClose();
      case 1:
      case 2:
        return search();
      case 3:
        return readSet();
      case 4:
        return useCell();
      case 5:
      case 6:
        return travel();
      default:
        return byte() < 8 ? build() : walk();
    }
  }

  void openAndClose() {
    filiform_set** const set = &sets_[byte() % kHandles];
    switch (byte() % 4) {
      case 0:
        told(filiform_close(*set));
        return;  // the closed handle stays in use
      case 1: {
        filiform_open_options options = sizedStruct<filiform_open_options>();
        options.memory_bytes = bytes_.number<std::uint32_t>();
        filiform_close(*set);
        told(filiform_open(files_.set.c_str(), &options, set));
        return;
      }
      case 2:
        filiform_close(*set);
        told(filiform_open(byte() < 128 ? "/nowhere.fil" : nullptr, nullptr, set));
        require(*set == nullptr, "a failed open gives no handle");
        return;
      default:
        filiform_close(*set);
        told(filiform_open(files_.set.c_str(), nullptr, set));
    }
  }

  void filtered(filiform_set* set, const std::array<double, 3>& at, const std::array<double, 3>& to) {
    std::array<const char*, 2> where{"measure:length>5", byte() < 128 ? "layer>=5" : "length"};
    std::array<std::uint16_t, 2> types{byte(), byte()};
    std::array<std::uint32_t, 2> cells{byte(), byte() % 2U};
    filiform_filter filter = sizedStruct<filiform_filter>();
    if (byte() < 128) filter.types = types.data(), filter.type_count = byte() % 3;
    if (byte() < 64) filter.cells = cells.data(), filter.cell_count = byte() % 3;
    if (byte() < 64) filter.where = where.data(), filter.where_count = byte() % 3;
    filiform_set* view = nullptr;
    told(filiform_open_filtered(set, &filter, &view));
    filiform_cell_count* counts = nullptr;
    std::size_t count = 0;
    told(filiform_box_counts(view, at.data(), to.data(), byte() % 2, &counts, &count));
    filiform_free(counts);
    filiform_level_segment* segments = nullptr;
    told(filiform_levels(view, at.data(), to.data(), number(), byte(), &segments, &count, nullptr));
    filiform_free(segments);
    double* values = nullptr;
    std::size_t rows = 0;
    told(filiform_measure(view, byte() < 128 ? cells.data() : nullptr, 2, "length", &values, &rows, &count));
    filiform_free(values);
    filiform_close(view);
  }

  void search() {
    filiform_set* const set = anyHandle(sets_);
    const std::array<double, 3> at = point(), to = point();
    filiform_hit* hits = nullptr;
    std::size_t count = 0;
    switch (byte() % 6) {
      case 0: {
        std::array<filiform_hit, kMostHits> found{};
        filiform_query query = sizedStruct<filiform_query>();
        query.k = byte() % (kMostHits + 1);
        query.epsilon = number();
        query.max_distance_um = number();
        query.approximate = byte() % 2;
        told(filiform_nearest(set, byte() < 4 ? nullptr : at.data(), &query, found.data(), &count));
        require(count <= std::max<std::size_t>(query.k, 1), "at most k results");
        return;
      }
      case 1: {
        std::array<filiform_hit, 2 * kMostHits> found{};
        std::array<std::size_t, 2> counts{};
        const std::array<double, 6> points{at[0], at[1], at[2], to[0], to[1], to[2]};
        filiform_query query = sizedStruct<filiform_query>();
        query.k = byte() % (kMostHits + 1);
        query.threads = byte() % 4;
        told(filiform_nearest_many(set, points.data(), byte() < 8 ? bytes_.number<std::size_t>() | 1ULL << 40 : 2,
                                   &query, found.data(), counts.data()));
        return;
      }
      case 2: {
        const int status = told(filiform_within(set, at.data(), number(), &hits, &count));
        return freeHits(status, hits, count);
      }
      case 3: {
        const int status = told(filiform_box(set, at.data(), to.data(), &hits, &count));
        return freeHits(status, hits, count);
      }
      case 4:
        return filtered(set, at, to);
      default: {
        filiform_ray_query ray = sizedStruct<filiform_ray_query>();
        for (int axis = 0; axis < 3; ++axis) {
          ray.origin_um[axis] = at[static_cast<std::size_t>(axis)];
          ray.direction[axis] = to[static_cast<std::size_t>(axis)];
        }
        ray.radius_um = number();
        ray.slope = number();
        ray.length_um = number();
        ray.most = byte();
        const int status = told(filiform_ray(set, &ray, &hits, &count));
        return freeHits(status, hits, count);
      }
    }
  }

  void readSet() {
    filiform_set* const set = anyHandle(sets_);
    switch (byte() % 5) {
      case 0: {
        filiform_info info = sizedStruct<filiform_info>();
        told(filiform_get_info(set, &info));
        return;
      }
      case 1: {
        filiform_cell_info info = sizedStruct<filiform_cell_info>();
        if (told(filiform_get_cell_info(set, byte() < 128 ? byte() % 4 : bytes_.number<std::uint32_t>(), &info)) ==
            FILIFORM_OK)
          require(info.name != nullptr, "a cell has a name");
        return;
      }
      case 2: {
        std::uint32_t* ids = nullptr;
        std::size_t count = 0;
        const std::string pattern(asText(bytes_.some(byte() % 8)));
        told(filiform_cells(set, byte() < 32 ? nullptr : pattern.c_str(), &ids, &count));
        filiform_free(ids);
        return;
      }
      case 3: {
        std::uint32_t id = 0;
        told(filiform_find_cell(set, byte() < 128 ? "cell" : "none", &id));
        return;
      }
      default: {
        double radius_um = 0;
        told(filiform_covering_radius(set, &radius_um));
      }
    }
  }

  filiform_place place() {
    filiform_place place{};
    place.segment = byte() < 240 ? byte() % 8 : bytes_.number<std::uint32_t>();
    place.t = byte() < 200 ? byte() / 255.0 : number();
    return place;
  }

  void useCell() {
    filiform_cell** const cell = &cells_[byte() % kHandles];
    switch (byte() % 8) {
      case 0:
        told(filiform_cell_close(*cell));
        return;
      case 1:
      case 2:
        filiform_cell_close(*cell);
        told(filiform_cell_open(anyHandle(sets_), byte() % 3, cell));
        return;
      case 3: {
        filiform_cell_arrays arrays = sizedStruct<filiform_cell_arrays>();
        if (told(filiform_cell_get_arrays(anyHandle(cells_), &arrays)) != FILIFORM_OK) return;
        for (std::size_t i = 0; i < arrays.links; ++i)
          require(arrays.ends[2 * i] < arrays.samples && arrays.ends[2 * i + 1] < arrays.samples, "ends are samples");
        return;
      }
      case 4: {
        double length_um = 0;
        told(filiform_cell_distance(*cell, place(), place(), &length_um));
        require(length_um >= 0, "lengths are not negative");
        return;
      }
      case 5: {
        filiform_place tip{};
        told(filiform_cell_farthest_tip(*cell, place(), &tip, nullptr, nullptr));
        return;
      }
      case 6: {
        filiform_path_point* points = nullptr;
        std::size_t count = 0;
        const int status = told(filiform_cell_path(*cell, place(), place(), &points, &count));
        require((status == FILIFORM_OK) == (count > 0), "a path has a point");
        filiform_free(points);
        return;
      }
      default: {
        filiform_place found{};
        told(filiform_cell_place(*cell, bytes_.number<std::int8_t>(), &found));
      }
    }
  }

  void travel() {
    filiform_travel** const travel = &travels_[byte() % kHandles];
    switch (byte() % 8) {
      case 0:
        told(filiform_travel_close(*travel));
        return;
      case 1: {
        filiform_travel_options options = sizedStruct<filiform_travel_options>();
        options.realtime = byte() < 16;
        options.zoom_um = number();
        options.rate_Hz = number();
        options.stiffness_N_m = number();
        options.max_force_N = byte() < 128 ? 0 : number();
        options.budget_bytes = byte() < 128 ? 0 : bytes_.number<std::uint16_t>();
        static constexpr std::array<const char*, 4> kMethods{nullptr, "force", "shading", "none"};
        options.method = kMethods[byte() % kMethods.size()];
        filiform_travel_close(*travel);
        told(filiform_travel_open(anyHandle(sets_), &options, travel));
        return;
      }
      case 2:
        told(filiform_travel_jump(*travel, byte() % 3, place()));
        return;
      case 3: {
        const std::array<double, 3> at = point();
        told(filiform_travel_jump_to(anyHandle(travels_), at.data()));
        return;
      }
      case 4:
        told(filiform_travel_zoom(*travel, number()));
        told(filiform_travel_rotate(*travel, number(), number()));
        told(filiform_travel_centre(*travel));
        return;
      case 5: {
        filiform_residency residency = sizedStruct<filiform_residency>();
        told(filiform_travel_residency(*travel, &residency));
        return;
      }
      default: {
        std::array<double, 3> hand_m = point();
        for (double& axis : hand_m) axis *= 1e-3;
        filiform_tick tick = sizedStruct<filiform_tick>();
        for (int i = 0; i < 4; ++i) {
          const int status = told(filiform_travel_tick(*travel, hand_m.data(), byte() < 240 ? 1e-3 : number(), &tick));
          if (status != FILIFORM_OK) return;
          for (const double force_N : tick.force_N) require(std::isfinite(force_N), "forces are finite");
        }
      }
    }
  }

  void walk() {
    static constexpr std::array<const char*, 6> kRoutes{nullptr, "longest", "random:1", "tour:2", "1:5", "nowhere"};
    filiform_run_options options = sizedStruct<filiform_run_options>();
    filiform_run_summary summary = sizedStruct<filiform_run_summary>();
    options.on_tick = stopSoon;
    options.has_cell = byte() % 2;
    options.cell = byte() % 3;
    options.route = kRoutes[byte() % kRoutes.size()];
    options.device = byte() < 32 ? "sim:none" : nullptr;
    options.seconds = byte() < 128 ? 0 : number();
    options.zoom_um = byte() < 128 ? 0 : number();
    options.rate_Hz = byte() < 128 ? 0 : number();
    options.stiffness_N_m = byte() < 128 ? 0 : number();
    options.speed_m_s = byte() < 192 ? 0 : number();
    options.latency_ms = byte() < 192 ? 0 : number();
    options.budget_bytes = byte() < 192 ? 0 : bytes_.number<std::uint16_t>();
    if (told(filiform_navigate(anyHandle(sets_), &options, &summary)) == FILIFORM_OK)
      require(std::isfinite(summary.max_force_N), "forces are finite");
  }

  // Every second ingest is cancelled; none may change the set.
  void build() {
    const char* const input = files_.swc.c_str();
    int calls = byte() % 8;
    filiform_ingest_options options = sizedStruct<filiform_ingest_options>();
    options.progress = cancelSoon;
    options.user = &calls;
    options.threads = 1;
    options.capacity = byte();
    options.unit = byte() < 32 ? "8,8" : nullptr;
    told(filiform_ingest(&input, byte() % 2, byte() < 128 ? files_.set.c_str() : nullptr, &options, nullptr));
  }

  Taker bytes_;
  const CallFiles& files_;
  std::array<filiform_set*, kHandles> sets_{};
  std::array<filiform_cell*, kHandles> cells_{};
  std::array<filiform_travel*, kHandles> travels_{};
};

}  // namespace

CallFiles makeCallFiles(const std::string& folder) {
  CallFiles files{folder + "/cell.fil", folder + "/cell.swc"};
  std::ofstream(files.swc) << "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 0 0 1 3\n5 3 40 0 0 1 4\n"
                              "6 4 20 10 0 2 3\n7 4 20 30 0 2 6\n";
  const char* const input = files.swc.c_str();
  filiform_ingest_options options{};
  options.struct_size = sizeof options;
  options.capacity = 2;
  options.threads = 1;
  require(filiform_ingest(&input, 1, files.set.c_str(), &options, nullptr) == FILIFORM_OK, "a set can be made");
  return files;
}

void fuzzCInterface(Input input, const CallFiles& files) { Sequence(input, files).run(); }

}  // namespace filiform::fuzz
