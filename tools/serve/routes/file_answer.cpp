// The answer of the routes files: files of a revision, by name, whole or in ranges.
#include "index/text.h"
#include "tools/serve/routes/service.h"

#include <algorithm>
#include <charconv>
#include <cstdio>

namespace filiform::tools {

namespace {

struct ByteRange {
  std::uint64_t first, bytes;
};

std::optional<std::uint64_t> digitsOf(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// What a file of a set is: its content or where it lies.
struct ServedFile {
  std::shared_ptr<const TileSet> set = {};  // nullptr: `text` is the content
  std::string name = {}, text = {}, tag = {};
  std::uint64_t bytes = 0;
};

// Only names that the set's manifest lists are found; no path of a request is opened.
std::optional<ServedFile> findFile(const Call& call, const std::string& revision, const std::string& name) {
  const std::shared_ptr<const TileSet> set = call.service.shelf.revision(call.served->name(), revision);
  if (set != nullptr && name == "manifest.json")
    return ServedFile{.text = set->manifest(), .tag = revision, .bytes = set->manifest().size()};
  // A set that has grown also lists files of earlier revisions.
  for (const TileSet* const listing : {set.get(), &call.served->set()}) {
    if (listing == nullptr) continue;
    for (const SetFile& file : listing->files()) {
      if (file.name != name || (file.revision.empty() ? listing->revision() : file.revision) != revision) continue;
      char tag[17];
      std::snprintf(tag, sizeof tag, "%016llx", static_cast<unsigned long long>(file.digest));
      return ServedFile{
          .set = listing == set.get() ? set : call.served->sharedSet(), .name = name, .tag = tag, .bytes = file.bytes};
    }
  }
  return std::nullopt;
}

[[noreturn]] void refuseRange(std::uint64_t bytes) {
  throw Refusal(416, "the range lies outside of the file's " + std::to_string(bytes) + " bytes");
}

// FIRST-LAST, FIRST- or -LAST_BYTES within the file; nullopt for another form, which HTTP says to ignore.
std::optional<ByteRange> rangeOf(std::string_view header, std::uint64_t bytes) {
  constexpr std::string_view kUnit = "bytes=";
  if (!header.starts_with(kUnit)) return std::nullopt;
  header.remove_prefix(kUnit.size());
  const std::size_t dash = header.find('-');
  if (dash == std::string_view::npos || header.find(',') != std::string_view::npos) return std::nullopt;
  const auto first = digitsOf(header.substr(0, dash)), last = digitsOf(header.substr(dash + 1));
  if (dash == 0) {
    if (!last) return std::nullopt;
    if (*last == 0 || bytes == 0) refuseRange(bytes);
    const std::uint64_t length = std::min(*last, bytes);
    return ByteRange{bytes - length, length};
  }
  if (!first || (!last && dash + 1 != header.size()) || (last && *last < *first)) return std::nullopt;
  if (*first >= bytes) refuseRange(bytes);
  return ByteRange{*first, std::min(last.value_or(bytes - 1), bytes - 1) - *first + 1};
}

Answer contentOf(const Call& call, const ServedFile& file, const ByteRange& range) {
  Answer answer{.type = file.name.ends_with(".json") || file.set == nullptr ? kJsonType : kBytesType};
  if (file.set != nullptr)
    answer.file = FileRange{file.set, file.name, range.first, range.bytes};
  else
    answer.body = file.text.substr(range.first, range.bytes);
  // A cache that others share must not give it to those who may not ask.
  const char* const kept = call.service.access.isOpen() ? "public" : "private";
  answer.headers = {{"Cache-Control", std::string(kept) + ", max-age=31536000, immutable"},
                    {"ETag", '"' + file.tag + '"'}};
  return answer;
}

// A part of a file under its own address.
Answer partAnswer(const Call& call, const ServedFile& file, const std::string& part) {
  const std::size_t dash = part.find('-');
  const auto first = digitsOf(std::string_view(part).substr(0, dash)),
             last = dash == std::string::npos ? std::nullopt : digitsOf(std::string_view(part).substr(dash + 1));
  if (!first || !last || *last < *first) throw Refusal(404, "give the range as FIRST-LAST, in bytes from 0");
  if (*last >= file.bytes) refuseRange(file.bytes);
  Answer answer = contentOf(call, file, {*first, *last - *first + 1});
  answer.type = kBytesType;  // a part of JSON is no JSON
  answer.headers[1].second = '"' + file.tag + '.' + part + '"';
  return answer;
}

}  // namespace

Answer fileAnswer(const Call& call) {
  if (call.captured.size() == 1) {  // CURRENT
    Answer answer{.type = "text/plain", .body = call.served->set().revision() + "\n"};
    answer.headers.emplace_back("Cache-Control", "no-store");
    return answer;
  }
  const std::string &revision = call.captured.at(1), &name = call.captured.at(2);
  const auto file = findFile(call, revision, name);
  if (!file)
    throw Refusal(404, "the set has no file '" + escaped(revision, 40) + "/" + escaped(name, 80) +
                           "'; read CURRENT and the revision's manifest.json");
  if (call.captured.size() == 4) return partAnswer(call, *file, call.captured[3]);
  Answer whole = contentOf(call, *file, {0, file->bytes});
  whole.headers.emplace_back("Accept-Ranges", "bytes");
  if (const std::string_view known = call.request.header("if-none-match"); !known.empty() && hasTag(known, file->tag)) {
    whole.status = 304;
    whole.type.clear();
    whole.body.clear();
    whole.file.reset();
    return whole;
  }
  const std::string_view unchanged = call.request.header("if-range");
  if (!unchanged.empty() && unchanged != '"' + file->tag + '"') return whole;
  const auto range = rangeOf(call.request.header("range"), file->bytes);
  if (!range) return whole;
  Answer part = contentOf(call, *file, *range);
  part.status = 206;
  part.headers.emplace_back("Accept-Ranges", "bytes");
  part.headers.emplace_back("Content-Range", "bytes " + std::to_string(range->first) + "-" +
                                                 std::to_string(range->first + range->bytes - 1) + "/" +
                                                 std::to_string(file->bytes));
  return part;
}

}  // namespace filiform::tools
