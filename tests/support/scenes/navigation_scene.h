// A navigation on a random column in memory, and states of a device that leads it.
#pragma once

#include "index/ingest/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "solver/workspace/navigation.h"
#include "tests/support/scenes/random_cells.h"

#include <memory>
#include <vector>

namespace filiform::test {

inline DeviceState handAt(const Eigen::Vector3d& p_D, std::uint32_t buttons = 0) {
  DeviceState state;
  state.p_D = p_D;
  state.buttons = buttons;
  state.status = DeviceStatus::ready;
  return state;
}

// A column in memory, and a navigation that starts at a place on its first cell.
struct NavigationScene {
  explicit NavigationScene(const NavigationOptions& options = {}, SolverMethod method = SolverMethod::basic,
                           std::uint32_t capacity = 32)
      : store(build(capacity)), table(store->tile_count()), graph(table, store->leaves(), store->grid()) {
    for (TileId id = 0; id < store->tile_count(); ++id) {
      held.push_back(store->load(id));
      table.add(*held.back());
    }
    SolverParameters parameters;
    parameters.r_min_um = 1;
    parameters.r_max_um = 20;
    navigation = std::make_unique<Navigation>(graph, makeProxySolver(method, parameters), options);
  }

  static std::unique_ptr<TileStore> build(std::uint32_t capacity) {
    CellList stream(randomColumn(3, 2, 600, 150));
    PartitionOptions partition;
    partition.capacity = capacity;
    return buildTilesInMemory(stream, partition);
  }

  ProxyPlace somewhere(std::uint32_t number = 0) const {
    for (TileId id = 0; id < store->tile_count(); ++id)
      for (std::uint32_t segment = 0; segment < held[id]->segment_count(); ++segment)
        if (held[id]->owned(segment) && !held[id]->isolated(segment) && number-- == 0)
          return graph.placeAt(id, held[id]->segmentId(segment), 0.5);
    return {};
  }

  bool command(NavigationCommand::Kind kind, const ProxyPlace& place = {},
               const Eigen::Vector3d& h_D = Eigen::Vector3d::Zero()) {
    NavigationCommand command;
    command.kind = kind;
    command.place = place;
    return navigation->apply(command, h_D);
  }

  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> held;
  TileTable table;
  GraphView graph;
  std::unique_ptr<Navigation> navigation;
};

inline Eigen::Vector3d forceOf(const NavigationTick& tick) { return tick.wrench.force_N; }

}  // namespace filiform::test
