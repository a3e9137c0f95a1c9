#include "renderer/trace/bsdf/microfacet_albedo.h"

#include <array>
#include <memory>
#include <type_traits>
#include <utility>

#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet.h"

namespace helio {

namespace {

// Nodes are equidistant in the fourth roots of mu and of alpha: the albedo of a smooth surface falls within mu < alpha,
// and that by a function of mu / alpha, so that it is ratios of neighbouring nodes that matter. Row 0 is the mirror,
// row 1 the smoothest rough surface.
constexpr int kMuNodes = 80, kAlphaNodes = 48;
// A Fibonacci lattice: 377 points and the step that goes with them.
constexpr int kLatticePoints = 377, kLatticeStep = 233;
const float kLeastRoot = std::sqrt(std::sqrt(kDeltaAlpha));

struct AlbedoTable {
  std::array<std::array<AlbedoTerms, kMuNodes>, kAlphaNodes> directional;
  std::array<AlbedoTerms, kAlphaNodes> mean;
  std::array<std::array<CosineWeights, kMuNodes>, kAlphaNodes> directional_weights;
  std::array<CosineWeights, kAlphaNodes> mean_weights;
  // int loss 2 mu dmu up to each node of mu.
  std::array<std::array<float, kMuNodes>, kAlphaNodes> lost_below;
};

float fourth_power(float x) {
  return sqr(sqr(x));
}

float fourth_root(float x) {
  return std::sqrt(safe_sqrt(x));
}

// Cell and position of a coordinate in [0, 1] among `nodes` equidistant nodes.
struct CellPosition {
  int index;
  float t;
};

CellPosition locate(float coordinate, int nodes) {
  const float x = std::clamp(coordinate, 0.0f, 1.0f) * (nodes - 1);
  const int index = std::min(static_cast<int>(x), nodes - 2);
  return {index, x - index};
}

CellPosition locate_alpha(float alpha) {
  const float root = fourth_root(alpha);
  if (root < kLeastRoot) return {0, root / kLeastRoot};
  CellPosition position = locate((root - kLeastRoot) / (1 - kLeastRoot), kAlphaNodes - 1);
  ++position.index;
  return position;
}

// Adds what is kept of light that meets facets under a cosine.
void add_weight(CosineWeights& weights, float cosine, float kept) {
  const CellPosition cell = locate(cosine, CosineWeights::kNodes);
  weights.w[std::size_t(cell.index)] += kept * (1 - cell.t);
  weights.w[std::size_t(cell.index) + 1] += kept * cell.t;
}

AlbedoTerms mirror_terms(float mu) {
  const float s = schlick_term(mu);
  return {1 - s, s, s, 0};
}

// Mean over visible normals.
void integrate(const Microfacet& microfacet, float mu, AlbedoTerms& terms, CosineWeights& weights) {
  const V3f wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
  double a = 0, b = 0, loss = 0;
  for (int i = 0; i < kLatticePoints; ++i) {
    const V2f u(float((i + 0.5) / kLatticePoints), float((i * kLatticeStep % kLatticePoints + 0.5) / kLatticePoints));
    const V3f m = microfacet.sample_visible_normal(wo, u);
    const float cos_m = std::max(0.0f, dot(wo, m));
    const double kept = microfacet.masking(m * (2 * cos_m) - wo), s = schlick_term(cos_m);
    a += kept * (1 - s);
    b += kept * s;
    loss += 1 - kept;
    add_weight(weights, cos_m, float(kept * (1 - s) / kLatticePoints));
  }
  terms = {static_cast<float>(a / kLatticePoints), static_cast<float>(b / kLatticePoints),
           static_cast<float>(b / (a + b)), static_cast<float>(loss / kLatticePoints)};
}

AlbedoTerms mix(const AlbedoTerms& p, const AlbedoTerms& q, float t) {
  return {p.a + (q.a - p.a) * t, p.b + (q.b - p.b) * t, p.s + (q.s - p.s) * t, p.loss + (q.loss - p.loss) * t};
}

CosineWeights mix(const CosineWeights& p, const CosineWeights& q, float t) {
  CosineWeights mixed;
  for (std::size_t k = 0; k < CosineWeights::kNodes; ++k) mixed.w[k] = p.w[k] + (q.w[k] - p.w[k]) * t;
  return mixed;
}

void add(AlbedoTerms& sum, const AlbedoTerms& terms, float weight) {
  sum = {sum.a + terms.a * weight, sum.b + terms.b * weight, sum.s + terms.s * weight, sum.loss + terms.loss * weight};
}

void add(CosineWeights& sum, const CosineWeights& weights, float weight) {
  for (std::size_t k = 0; k < CosineWeights::kNodes; ++k) sum.w[k] += weights.w[k] * weight;
}

// 2 int E(mu) mu dmu = 8 int E(x) x^7 dx with x the fourth root of mu, E linear in x within a cell: what the two nodes
// of cell i weigh are integrals of polynomials of degree 8, exact by five Gauss points.
std::pair<double, double> node_weights(int i) {
  constexpr double kNode[5] = {0.046910077030668, 0.230765344947158, 0.5, 0.769234655052842, 0.953089922969332};
  constexpr double kWeight[5] = {0.118463442528095, 0.239314335249683, 0.284444444444444, 0.239314335249683,
                                 0.118463442528095};
  double low = 0, high = 0;
  for (int q = 0; q < 5; ++q) {
    const double t = kNode[q], weight = 8 * std::pow((i + t) / (kMuNodes - 1), 7) * kWeight[q] / (kMuNodes - 1);
    low += weight * (1 - t);
    high += weight * t;
  }
  return {low, high};
}

template <typename Terms>
Terms integrate_mean(const std::array<Terms, kMuNodes>& row) {
  std::array<double, kMuNodes> weights{};
  for (int i = 0; i + 1 < kMuNodes; ++i) {
    const auto [low, high] = node_weights(i);
    weights[std::size_t(i)] += low;
    weights[std::size_t(i) + 1] += high;
  }
  Terms mean{};
  if constexpr (std::is_same_v<Terms, AlbedoTerms>) mean.a = 0;
  for (std::size_t i = 0; i < kMuNodes; ++i) add(mean, row[i], float(weights[i]));
  return mean;
}

std::array<float, kMuNodes> accumulate_loss(const std::array<AlbedoTerms, kMuNodes>& row) {
  std::array<float, kMuNodes> below{};
  double sum = 0;
  for (int i = 0; i + 1 < kMuNodes; ++i) {
    const auto [low, high] = node_weights(i);
    sum += low * double(row[std::size_t(i)].loss) + high * double(row[std::size_t(i) + 1].loss);
    below[std::size_t(i) + 1] = float(sum);
  }
  return below;
}

std::unique_ptr<const AlbedoTable> build_table(MicrofacetDistribution distribution) {
  auto table = std::make_unique<AlbedoTable>();
  for (std::size_t j = 0; j < kAlphaNodes; ++j) {
    const float root = kLeastRoot + (1 - kLeastRoot) * (float(j) - 1) / (kAlphaNodes - 2);
    const Microfacet microfacet{distribution, fourth_power(root)};
    for (std::size_t i = 0; i < kMuNodes; ++i) {
      const float mu = fourth_power(float(i) / (kMuNodes - 1));
      AlbedoTerms& terms = table->directional[j][i];
      CosineWeights& weights = table->directional_weights[j][i];
      if (j > 0) {
        integrate(microfacet, mu, terms, weights);
      } else {
        terms = mirror_terms(mu);
        add_weight(weights, mu, terms.a);
      }
    }
    table->mean[j] = integrate_mean(table->directional[j]);
    table->mean_weights[j] = integrate_mean(table->directional_weights[j]);
    table->lost_below[j] = accumulate_loss(table->directional[j]);
  }
  return table;
}

template <typename Terms>
Terms look_up(const std::array<std::array<Terms, kMuNodes>, kAlphaNodes>& table, const AlbedoRow& row, float mu) {
  const CellPosition column = locate(fourth_root(mu), kMuNodes);
  const std::size_t i = std::size_t(column.index), j = std::size_t(row.index);
  const auto& low = table[j];
  const auto& high = table[j + 1];
  return mix(mix(low[i], low[i + 1], column.t), mix(high[i], high[i + 1], column.t), row.t);
}

template <typename Terms>
Terms look_up(const std::array<Terms, kAlphaNodes>& means, const AlbedoRow& row) {
  return mix(means[std::size_t(row.index)], means[std::size_t(row.index) + 1], row.t);
}

// Share of directions that follow the loss.
constexpr float kByLoss = 0.875f;

// Squared cosine of a node.
float squared_node(int i) {
  return sqr(fourth_power(float(i) / (kMuNodes - 1)));
}

// What is lost below each node, for one alpha.
class LostBelow {
 public:
  LostBelow(const AlbedoTable& table, const AlbedoRow& row)
      : t_(row.t),
        low_(table.lost_below[std::size_t(row.index)]),
        high_(table.lost_below[std::size_t(row.index) + 1]) {}

  float operator[](int i) const {
    return low_[std::size_t(i)] + (high_[std::size_t(i)] - low_[std::size_t(i)]) * t_;
  }
  float all() const { return (*this)[kMuNodes - 1]; }

 private:
  float t_;
  const std::array<float, kMuNodes>&low_, &high_;
};

const AlbedoTable& table_of(MicrofacetDistribution distribution) {
  if (distribution == MicrofacetDistribution::beckmann ||
      distribution == MicrofacetDistribution::beckmann_anisotropic) {
    static const std::unique_ptr<const AlbedoTable> beckmann = build_table(MicrofacetDistribution::beckmann);
    return *beckmann;
  }
  static const std::unique_ptr<const AlbedoTable> ggx = build_table(MicrofacetDistribution::ggx);
  return *ggx;
}

}  // namespace

AlbedoRow albedo_row(MicrofacetDistribution distribution, float alpha) {
  const CellPosition position = locate_alpha(alpha);
  return {distribution, position.index, position.t};
}

AlbedoTerms directional_albedo(const AlbedoRow& row, float mu) {
  return look_up(table_of(row.distribution).directional, row, mu);
}

AlbedoTerms mean_albedo(const AlbedoRow& row) {
  return look_up(table_of(row.distribution).mean, row);
}

CosineWeights directional_weights(const AlbedoRow& row, float mu) {
  return look_up(table_of(row.distribution).directional_weights, row, mu);
}

CosineWeights mean_weights(const AlbedoRow& row) {
  return look_up(table_of(row.distribution).mean_weights, row);
}

float sample_loss_cosine(const AlbedoRow& row, float u) {
  if (u >= kByLoss) return std::sqrt((u - kByLoss) / (1 - kByLoss));
  const LostBelow below(table_of(row.distribution), row);
  const float wanted = u / kByLoss * below.all();
  int cell = 0, end = kMuNodes - 1;
  while (end - cell > 1) {
    const int middle = (cell + end) / 2;
    (below[middle] <= wanted ? cell : end) = middle;
  }
  const float lost = below[cell + 1] - below[cell];
  const float t = lost > 0 ? std::clamp((wanted - below[cell]) / lost, 0.0f, 1.0f) : 0.5f;
  return std::sqrt(squared_node(cell) + (squared_node(cell + 1) - squared_node(cell)) * t);
}

float loss_pdf_w(const AlbedoRow& row, float mu) {
  const LostBelow below(table_of(row.distribution), row);
  const int cell = locate(fourth_root(mu), kMuNodes).index;
  const float squares = squared_node(cell + 1) - squared_node(cell), all = below.all();
  const float by_loss = all > 0 ? (below[cell + 1] - below[cell]) / (all * squares) : 1.0f;
  return (kByLoss * by_loss + (1 - kByLoss)) * mu * kInvPi;
}

AlbedoTableView albedo_table(MicrofacetDistribution distribution) {
  const AlbedoTable& table = table_of(distribution);
  return {kMuNodes,
          {table.directional.front().data(), kMuNodes * kAlphaNodes},
          table.mean,
          {table.lost_below.front().data(), kMuNodes * kAlphaNodes}};
}

void prepare_albedo_tables(MicrofacetDistribution distribution) {
  table_of(distribution);
}

}  // namespace helio
