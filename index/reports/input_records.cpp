#include "index/reports/input_records.h"

#include "index/file/internal/record_store.h"

#include <algorithm>
#include <utility>

namespace filiform {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{64} << 10;  // of a sequence in memory, before the store

void putVarint(std::vector<std::uint8_t>& out, std::uint64_t v) {
  for (; v >= 128; v >>= 7) out.push_back(static_cast<std::uint8_t>(v | 128));
  out.push_back(static_cast<std::uint8_t>(v));
}

}  // namespace

// Encodes a run: code and effect; twice the count plus 1 if there is a token; distance of its first line from that of
// the run before; the step if count > 1; the token.
void InputRecords::encode(Tape& tape) {
  Run& run = tape.run;
  if (run.count == 0) return;
  std::vector<std::uint8_t>& out = tape.held;
  out.push_back(static_cast<std::uint8_t>(run.code));
  out.push_back(static_cast<std::uint8_t>(run.effect));
  putVarint(out, 2 * run.count + (run.token.empty() ? 0 : 1));
  putVarint(out, run.line - tape.base);
  if (run.count > 1) putVarint(out, run.step);
  if (!run.token.empty()) {
    putVarint(out, run.token.size());
    out.insert(out.end(), run.token.begin(), run.token.end());
  }
  tape.base = run.line;
  run = {};
}

void InputRecords::put(Tape& tape) {
  if (tape.held.empty()) return;
  if (!store_) store_ = internal::RecordStore::shared();
  const std::uint64_t at = store_->append(tape.held);
  if (!tape.pieces.empty() && tape.pieces.back().at + tape.pieces.back().bytes == at) {
    tape.pieces.back().bytes += tape.held.size();
  } else {
    tape.pieces.push_back({at, tape.held.size()});
  }
  tape.held.clear();
}

void InputRecords::add(const InputRecord& record) {
  ++size_;
  ++counts_[static_cast<std::size_t>(record.effect)];
  // The first sequence that the line continues, so that equal lines keep the order of insertion.
  const auto found =
      std::find_if(tapes_.begin(), tapes_.end(), [&](const Tape& tape) { return tape.last_line <= record.line; });
  Tape& tape = found != tapes_.end() ? *found : tapes_.emplace_back();
  Run& run = tape.run;
  tape.last_line = record.line;
  if (run.count > 0 && run.token.empty() && record.token.empty() && run.code == record.code &&
      run.effect == record.effect) {
    if (run.count == 1) run.step = record.line - run.line;
    if (record.line == run.line + run.count * run.step) {
      ++run.count;
      return;
    }
  }
  encode(tape);
  if (tape.held.size() >= kPieceBytes) put(tape);
  run = {record.line, 0, 1, record.code, record.effect, record.token};
}

void InputRecords::addFirst(InputRecord record) {
  ++size_;
  ++counts_[static_cast<std::size_t>(record.effect)];
  Tape& tape = *tapes_.emplace(tapes_.begin());
  tape.run = {0, 0, 1, record.code, record.effect, std::move(record.token)};
}

void InputRecords::close() {
  for (Tape& tape : tapes_) {
    encode(tape);
    put(tape);
    tape.held = {};
  }
}

void InputRecords::clear() { *this = {}; }

InputRecord InputRecords::front() const { return *begin(); }

InputRecord InputRecords::operator[](std::uint64_t place) const {
  Iterator at(*this);
  for (; place > 0; --place) ++at;
  return *at;
}

// Iterates over a sequence: first the store, then memory, then the run that is not encoded.
class InputRecords::TapeReader {
 public:
  TapeReader(const Tape& tape, const internal::RecordStore* store) : tape_(&tape), store_(store) { next(); }

  bool done() const { return run_.count == 0; }
  std::uint64_t line() const { return run_.line; }
  void read(InputRecord& record) const {
    record.line = run_.line;
    record.code = run_.code;
    record.effect = run_.effect;
    record.token = run_.token;
  }
  void next() {
    if (run_.count > 1) {
      --run_.count;
      run_.line += run_.step;
      return;
    }
    run_ = {};
    if (!more()) {
      if (std::exchange(at_end_, true)) return;
      run_ = tape_->run;
      return;
    }
    run_.code = static_cast<InputCode>(byte());
    run_.effect = static_cast<Effect>(byte());
    const std::uint64_t count = varint();
    run_.count = count / 2;
    run_.line = base_ += varint();
    if (run_.count > 1) run_.step = varint();
    if (count % 2 == 1)
      for (std::uint64_t left = varint(); left > 0; --left) run_.token += static_cast<char>(byte());
  }

 private:
  bool more() {
    while (at_ == window_.size()) {
      at_ = 0;
      if (piece_ < tape_->pieces.size()) {
        const Piece& piece = tape_->pieces[piece_];
        window_.resize(std::min<std::uint64_t>(kPieceBytes, piece.bytes - in_piece_));
        store_->read(piece.at + in_piece_, window_);
        in_piece_ += window_.size();
        if (in_piece_ == piece.bytes) ++piece_, in_piece_ = 0;
      } else if (!std::exchange(held_read_, true)) {
        window_ = tape_->held;
      } else {
        window_.clear();
        return false;
      }
    }
    return true;
  }
  std::uint8_t byte() { return more() ? window_[at_++] : std::uint8_t{0}; }
  std::uint64_t varint() {
    std::uint64_t v = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint8_t b = byte();
      v |= std::uint64_t{b & 127u} << shift;
      if (b < 128) return v;
    }
  }

  const Tape* tape_;
  const internal::RecordStore* store_;
  std::vector<std::uint8_t> window_;
  std::size_t at_ = 0, piece_ = 0;
  std::uint64_t in_piece_ = 0, base_ = 0;
  bool held_read_ = false, at_end_ = false;
  Run run_;
};

InputRecords::Iterator InputRecords::begin() const { return Iterator(*this); }

InputRecords::Iterator::Iterator(const InputRecords& records) {
  readers_.reserve(records.tapes_.size());
  for (const Tape& tape : records.tapes_) readers_.emplace_back(tape, records.store_.get());
  ++*this;
}
InputRecords::Iterator::Iterator(Iterator&&) noexcept = default;
InputRecords::Iterator& InputRecords::Iterator::operator=(Iterator&&) noexcept = default;
InputRecords::Iterator::~Iterator() = default;

InputRecords::Iterator& InputRecords::Iterator::operator++() {
  TapeReader* lowest = nullptr;
  for (TapeReader& reader : readers_)
    if (!reader.done() && (lowest == nullptr || reader.line() < lowest->line())) lowest = &reader;
  done_ = lowest == nullptr;
  if (lowest == nullptr) return *this;
  lowest->read(record_);
  lowest->next();
  return *this;
}

}  // namespace filiform
