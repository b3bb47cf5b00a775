#include "solver/travel/run/recorded_options.h"

#include "device/recording/replay.h"
#include "index/errors.h"
#include "index/text.h"
#include "solver/travel/routes/default_cell.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <functional>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform {

const char* const kSessionOptions = R"({"session":true})";

namespace {

constexpr std::string_view kReplayDevice = "replay:";

template <typename T>
std::string toldNumber(T value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

template <typename T>
T recordedNumber(const std::string& text) {
  const auto value = nlohmann::json::parse(text, nullptr, false);
  if (!value.is_number()) throw UsageError("is no number");
  return value.get<T>();
}

// An option as text. get(): empty for none.
struct TextOption {
  const char* name;
  std::function<std::string(const RunOptions&)> get;
  std::function<void(RunOptions&, const std::string&)> set;
};

template <typename T>
TextOption numberOption(const char* name, T RunOptions::*member) {
  return {name, [member](const RunOptions& o) { return toldNumber(o.*member); },
          [member](RunOptions& o, const std::string& text) { o.*member = recordedNumber<T>(text); }};
}

TextOption optionalNumberOption(const char* name, std::optional<double> RunOptions::*member) {
  return {name, [member](const RunOptions& o) { return o.*member ? toldNumber(*(o.*member)) : std::string(); },
          [member](RunOptions& o, const std::string& text) { o.*member = recordedNumber<double>(text); }};
}

std::vector<TextOption> textOptions(const TileStore& store) {
  return {
      {"--cell",
       [&store](const RunOptions& o) { return o.cell ? std::string(store.cell(*o.cell).name) : std::string(); },
       [&store](RunOptions& o, const std::string& text) {
         o.cell = store.findCell(text);
         if (!o.cell) throw UsageError("the set has no such cell");
       }},
      {"--route", [](const RunOptions& o) { return toString(o.route); },
       [](RunOptions& o, const std::string& text) { o.route = routeChoiceOf(text); }},
      optionalNumberOption("--seconds", &RunOptions::seconds),
      {"--method", [](const RunOptions& o) { return std::string(toString(o.method)); },
       [](RunOptions& o, const std::string& text) { o.method = solverMethod(text); }},
      optionalNumberOption("--stiffness", &RunOptions::stiffness_N_m),
      {"--passivity", [](const RunOptions& o) { return std::string(o.passivity ? *o.passivity ? "on" : "off" : ""); },
       [](RunOptions& o, const std::string& text) {
         if (text != "auto") o.passivity = text == "on";
       }},
      numberOption("--zoom", &RunOptions::zoom_um),
      numberOption("--leap", &RunOptions::leap),
      {"--speed", [](const RunOptions& o) { return toldNumber(o.person.speed_m_s); },
       [](RunOptions& o, const std::string& text) { o.person.speed_m_s = recordedNumber<double>(text); }},
      numberOption("--rate", &RunOptions::rate_Hz),
      numberOption("--seed", &RunOptions::seed),
  };
}

}  // namespace

std::string recordedOptions(const TileStore& store, const RunOptions& options, std::optional<std::uint32_t> cell) {
  RunOptions told = options;
  if (cell) told.cell = cell;
  nlohmann::json json = nlohmann::json::object();
  for (const TextOption& option : textOptions(store))
    if (std::string value = option.get(told); !value.empty()) json[option.name] = std::move(value);
  return json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::vector<std::string> takeRecordedOptions(const TileStore& store, RunOptions& options) {
  if (!options.device.starts_with(kReplayDevice)) return {};
  const std::string file = options.device.substr(kReplayDevice.size());
  if (isSessionRecording(file))
    throw UsageError(escaped(file) +
                     ": was recorded by view or serve; replay it with filiform view SET --device replay:" +
                     escaped(file) + ", or draw it with filiform render --path");
  const auto json = nlohmann::json::parse(readRecordingWords(file).options, nullptr, false);
  if (!json.is_object()) return {};
  const RunOptions defaults;
  std::string taken, kept;
  for (const TextOption& option : textOptions(store)) {
    if (!json.contains(option.name) || !json.at(option.name).is_string()) continue;
    const std::string value = json.at(option.name), now = option.get(options);
    const bool given = now != option.get(defaults) ||
                       std::find(options.given.begin(), options.given.end(), option.name) != options.given.end();
    RunOptions as_recorded = options;
    try {
      option.set(as_recorded, value);
    } catch (const UsageError& error) {
      if (!given)
        throw UsageError(escaped(file) + ": was recorded with " + option.name + " " + escaped(value) +
                         ", which cannot be used here: " + error.what());
    }
    if (option.get(as_recorded) == now) continue;
    if (given) {
      kept += std::string(" ") + option.name + " " + escaped(now) + " (recorded: " + escaped(value) + ")";
      continue;
    }
    options = std::move(as_recorded);
    const bool is_usual = option.name == std::string_view("--cell") && options.cell == defaultCell(store);
    if (!is_usual) taken += std::string(" ") + option.name + " " + escaped(value);
  }
  std::vector<std::string> notes;
  if (!taken.empty()) notes.push_back("options taken from the recording:" + taken);
  if (!kept.empty()) notes.push_back("options given instead of those of the recording:" + kept);
  return notes;
}

bool isSessionRecording(const std::string& recording) {
  const RecordingWords words = readRecordingWords(recording);
  std::error_code none;
  return words.options == kSessionOptions ||
         (words.options.empty() && std::filesystem::exists(recording + ".json", none));
}

}  // namespace filiform
