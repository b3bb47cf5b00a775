// filiform contacts: where segments of different cells lie within a distance.
#include "index/attributes/cell_attributes.h"
#include "index/cell/attribute_conditions.h"
#include "index/contacts/cell_copies.h"
#include "index/contacts/contacts.h"
#include "index/export/zip_writer.h"
#include "index/measure/cell_measures.h"
#include "index/output.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/cell_conditions.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/contact_rows.h"
#include "tools/words/filter_words.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

constexpr std::uint64_t kMinContactMemory = std::uint64_t{64} << 20;

struct ContactArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string set, types, within, out = "-", matrix, memory = "1GiB";
  std::vector<std::string> from, to;
  unsigned threads = 0;
  bool surface = false, no_copies = false;
};

enum class ContactOutput : std::uint8_t { kTable, kArrays, kMatrix };

ContactOutput outputOf(const ContactArguments& a) {
  if (endsWithNoCase(a.out, ".npz")) {
    if (!a.matrix.empty()) throw UsageError("--matrix writes a table: give -o a name that ends in .tsv");
    return ContactOutput::kArrays;
  }
  if (!endsWithNoCase(a.out, ".tsv") && isFileOutput(a.out))
    throw UsageError("-o " + inShort(a.out) + ": the name must end in .tsv or .npz");
  return a.matrix.empty() ? ContactOutput::kTable : ContactOutput::kMatrix;
}

// `given`: what was written after the option.
std::uint32_t columnNamed(const CellAttributes& attributes, const std::string& name, const std::string& option,
                          const std::string& given) {
  if (const auto column = attributes.find(name)) return *column;
  NearNames near(name);
  for (const CellAttributes::Column& column : attributes.columns()) near.offer(column.name);
  throw UsageError(option + " " + inShort(given) + ": " +
                   (attributes.empty() ? "the cells of this set have no attributes; 'filiform attributes' adds them"
                                       : "the cells have no attribute of this name") +
                   didYouMean(near.names()) +
                   (near.names().empty() && !attributes.empty() ? "; 'filiform info SET' lists them" : ""));
}

// Errors of conditions name --where, as other commands do; here the option has another name.
template <class Call>
auto underOption(const std::string& option, const Call& call) {
  try {
    return call();
  } catch (const UsageError& e) {
    const std::string what = e.what(), usual = "--where";
    throw UsageError(what.starts_with(usual) ? option + what.substr(usual.size()) : what);
  }
}

std::vector<std::uint32_t> cellsThatMeet(const std::vector<std::string>& conditions, const std::string& option,
                                         const TileSet& set, const CellAttributes& attributes, unsigned threads) {
  return underOption(option, [&] {
    const AttributeConditions parsed(conditions);
    for (const AttributeConditions::Condition& condition : parsed.all())
      if (!condition.name.starts_with(kMeasurePrefix)) columnNamed(attributes, condition.name, option, condition.whole);
    return cellsMeeting(CellConditions(conditions), set, attributes, threads);
  });
}

void nameCopies(const TileSet& set, const std::vector<CellCopy>& copies, bool left_out) {
  if (copies.empty()) return;
  constexpr std::size_t kMostNamed = 5;
  std::string names;
  for (std::size_t i = 0; i < std::min(copies.size(), kMostNamed); ++i)
    names += (i == 0 ? "'" : ", '") + escaped(set.cell(copies[i].cell).name, 80) + "' of '" +
             escaped(set.cell(copies[i].of).name, 80) + "'";
  std::cerr << "filiform: note: " << counted(copies.size(), "cell is a copy of another", "cells are copies of others")
            << " (" << names << (copies.size() > kMostNamed ? ", ..." : "") << "); "
            << (left_out ? "their contacts are left out" : "--no-copies leaves their contacts out") << '\n';
}

int runContacts(const ContactArguments& a) {
  ContactOptions options;
  options.within_um = parseNumber("--within", a.within);
  if (!(options.within_um > 0)) throw UsageError("--within " + inShort(a.within) + ": the distance must be above 0 um");
  options.surface = a.surface;
  options.memory_bytes = parseBytes("--memory", a.memory);
  if (options.memory_bytes < kMinContactMemory)
    throw UsageError("--memory " + inShort(a.memory) + ": give at least " + formatBytes(kMinContactMemory));
  options.threads = a.threads > 0 ? a.threads : std::max(1U, std::thread::hardware_concurrency());
  std::array types = parseTypesOfSides(a.types, "--types");
  options.from_types = std::move(types[0]), options.to_types = std::move(types[1]);
  const ContactOutput kind = outputOf(a);
  // Wrong conditions are refused before the set is read.
  underOption("--from", [&] { return CellConditions(a.from); });
  underOption("--to", [&] { return CellConditions(a.to); });
  checkOutputs({{"SET", a.set}}, {{"-o", a.out}});
  const auto set = TileSet::open(a.set, a.remote->options());
  const CellAttributes attributes(*set);
  std::optional<ContactMatrix> matrix;
  const bool counts_values = !a.matrix.empty();
  const std::uint32_t column = counts_values ? columnNamed(attributes, a.matrix, "--matrix", a.matrix) : 0;
  options.from = cellsThatMeet(a.from, "--from", *set, attributes, options.threads);
  options.to = a.from == a.to ? options.from : cellsThatMeet(a.to, "--to", *set, attributes, options.threads);

  std::vector<std::uint32_t> cells;
  std::set_union(options.from.begin(), options.from.end(), options.to.begin(), options.to.end(),
                 std::back_inserter(cells));
  const std::vector<CellCopy> copies =
      findCopies(*set, cells, options.memory_bytes / 2, options.threads, throwIfInterrupted);
  if (a.no_copies)
    for (auto* side : {&options.from, &options.to})
      std::erase_if(*side, [&](std::uint32_t cell) {
        const auto at = std::lower_bound(copies.begin(), copies.end(), cell,
                                         [](const CellCopy& copy, std::uint32_t id) { return copy.cell < id; });
        return at != copies.end() && at->cell == cell;
      });
  if (counts_values)
    matrix.emplace(attributes, column, options.from, options.to,
                   options.from == options.to && options.from_types == options.to_types);
  options.detail = matrix ? ContactOptions::Detail::kCounts : ContactOptions::Detail::kPlaces;

  Progress progress({.title = "contacts", .noun = "tiles"});
  options.check = [&](std::uint64_t done, std::uint64_t tiles) {
    throwIfInterrupted();
    progress.setTotal(tiles);
    progress.update(done);
  };
  Output out(a.out, {.by_name = kind == ContactOutput::kArrays, .cancel = &interruptFlag()});
  ContactArrays arrays(*set);
  if (kind == ContactOutput::kTable) out.write(contactTitles());
  std::string rows;
  const ContactCounts counts = findContacts(*set, options, [&](const ContactSite& site) {
    if (matrix) {
      matrix->add(site);
    } else if (kind == ContactOutput::kArrays) {
      arrays.add(site);
      if (arrays.bytes() > options.memory_bytes / 2)
        throw UsageError("-o " + inShort(a.out) +
                         ": the contact sites exceed the memory of arrays; write a .tsv, or "
                         "give more --memory");
    } else {
      appendContactRow(rows, *set, site);
      if (rows.size() < std::size_t{1} << 16) return;
      out.write(rows);
      rows.clear();
    }
  });
  progress.finish();
  if (kind == ContactOutput::kArrays) {
    writeZip(out.partialPath(), a.out,
             {.entries = arrays.columns(),
              .name = [&](std::size_t i) { return arrays.title(i) + ".npy"; },
              .text = [&](std::size_t i) { return arrays.npy(i); }});
  } else if (matrix) {
    matrix->write(out.stream());
  } else {
    out.write(rows);
  }
  out.finish();
  nameCopies(*set, copies, a.no_copies);
  if (counts.unknown_radii > 0)
    std::cerr << "filiform: note: " << counted(counts.unknown_radii, "pair has", "pairs have")
              << " a sample of unknown radius, which counts 0\n";
  if (options.from.empty() || options.to.empty())
    std::cerr << "filiform: note: no cell meets the conditions of " << (options.from.empty() ? "--from" : "--to")
              << '\n';
  if (!isStandardOutput(a.out))
    std::cout << inShort(a.out) << ": " << counted(counts.sites, "contact site") << " of "
              << counted(counts.pairs, "pair of segments", "pairs of segments") << '\n';
  return 0;
}

void addCondition(CLI::App& command, const char* name, std::vector<std::string>& conditions, const char* text) {
  command.add_option(name, conditions, text)->type_name("CONDITION")->allow_extra_args(false);
}

}  // namespace

void addContacts(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<ContactArguments>();
  CLI::App* command = app.add_subcommand("contacts", "Find where segments of different cells lie within a distance");
  command->footer(
      "Examples:\n  filiform contacts column.fil --within 2 -o contacts.tsv\n"
      "  filiform contacts column.fil --types axon,dendrite --within 2 -o contacts.npz\n"
      "  filiform contacts circuit.fil --from 'layer>=5' --to layer=4 --surface --within 0.5 -o contacts.tsv\n"
      "  filiform contacts circuit.fil --types axon,dendrite --within 2 --matrix layer -o matrix.tsv\n"
      "A row is a contact site: pairs of segments of two cells that are next to each other on both cells.\n"
      "tools/README.md says what the columns are.");
  command->add_option("SET", a->set, "tile set, or its address")->required();
  addCondition(*command, "--from", a->from,
               "take the first cell among those that meet NAME=VALUE and others, as --where of 'filiform measure'; "
               "repeatable: all must hold");
  addCondition(*command, "--to", a->to, "the same for the second cell; repeatable");
  command
      ->add_option("--types", a->types,
                   "take only segments of these types, of the first and of the second cell: axon, dendrite (basal or "
                   "apical), basal, apical, soma, undefined, any, or codes of SWC; + joins several")
      ->type_name("TYPE,TYPE");
  command->add_option("--within", a->within, "find what lies at most UM apart")->type_name("UM")->required();
  command->add_flag("--surface", a->surface,
                    "measure between surfaces, not axes: round cones; an unknown radius counts 0");
  command->add_flag("--no-copies", a->no_copies, "leave out cells whose samples are those of a cell before them");
  command->add_option("--matrix", a->matrix, "count the sites between the values of this attribute instead")
      ->type_name("ATTRIBUTE");
  command->add_option("-o,--output", a->out, "write this .tsv or .npz; -: standard output, as TSV")
      ->type_name("FILE")
      ->capture_default_str();
  command
      ->add_option("--memory", a->memory, "use at most this memory and 64MiB; at least 64MiB (K, M, G: KiB, MiB, GiB)")
      ->type_name("BYTES")
      ->capture_default_str();
  command->add_option("--threads", a->threads, "use N threads; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runContacts(*a); }; });
}

}  // namespace filiform::tools
