"""A glTF metallic-roughness surface with the Beckmann distribution as a BSDF of Mitsuba 3, for the references alone.

Written from the formulas, with numerical integrals in the place of the renderer's tables and with the simplest
sampling, so that it shares nothing with what it is to check:

    f = F D G1(wo) G1(wi) / (4 cos_o cos_i) + base / pi T(wo) T(wi) / T_mean
        + metallic F_ms (1 - E(wo)) (1 - E(wi)) / (pi (1 - E_mean))                     (one side, both cosines > 0)

    F        Schlick 1994 from r0 = metallic base_color + (1 - metallic) f0 to 1; f0 = ((ior - 1) / (ior + 1))^2
    D, G1    Beckmann; Smith's masking exactly (Walter et al. 2007, eq. 25 and the one above 27), both sides separately
    base     (1 - metallic) base_color
    T        what the interface of r0 = f0 lets in along a direction, T_mean its cosine-weighted mean (manual of
             renderer/trace/bsdf/bsdf_layered.h): 1 - F_1 + (1 - f0) (F_1 - A), where A is the albedo of the lobe and F_1
             the mean of F over the light that the lobe sends out.
    E, F_ms  albedo of the lobe for F = 1; F^2 E_mean / (1 - F (1 - E_mean)) with the mean F of Schlick's from
             base_color, (1 + 20 base_color) / 21 (Kulla and Conty 2017, Hill 2018).
"""
import drjit as dr
import mitsuba as mi

COSINES, NORMALS = 512, 192  # table entries over [0, 1]; microfacet normals a side of the quadrature's square


def smith_g1(alpha, cos_theta):
    """1 for light straight along the normal; 0 below the surface."""
    sine = dr.safe_sqrt(1 - cos_theta * cos_theta)
    cotangent = cos_theta / dr.maximum(alpha * sine, 1e-7)
    a = dr.clip(cotangent, 1e-7, 10)
    masked = 0.5 * (dr.erf(a) - 1 + dr.exp(-a * a) / (a * dr.sqrt(dr.pi)))
    return dr.select(cos_theta > 0, dr.select(cotangent > 10, 1, 1 / (1 + masked)), 0)


def beckmann_normal(alpha, sample):
    """A normal with density D cos_m, from a point of the unit square."""
    tan2 = -(alpha * alpha) * dr.log(1 - sample.x)
    cosine = dr.rsqrt(1 + tan2)
    sine = dr.safe_sqrt(1 - cosine * cosine)
    s, c = dr.sincos(2 * dr.pi * sample.y)
    return mi.Vector3f(sine * c, sine * s, cosine)


def beckmann_density(alpha, cos_m):
    """D(m), m above the surface."""
    cos2 = cos_m * cos_m
    tan2 = (1 - cos2) / cos2
    return dr.exp(-tan2 / (alpha * alpha)) / (dr.pi * alpha * alpha * cos2 * cos2)


def schlick(r0, cosine):
    return r0 + (1 - r0) * dr.power(dr.clip(1 - cosine, 0, 1), 5)


def integrate_lobe(alpha, f0):
    """T and 1 - E at the cosines (i + 0.5) / COSINES."""
    entering, lost = [], []
    n = NORMALS
    index = dr.arange(mi.UInt32, n * n)
    m = beckmann_normal(alpha, mi.Point2f((mi.Float(index % n) + 0.5) / n, (mi.Float(index // n) + 0.5) / n))
    for i in range(COSINES):
        cosine = (i + 0.5) / COSINES
        wo = mi.Vector3f((1 - cosine * cosine) ** 0.5, 0, cosine)
        along = dr.dot(wo, m)
        wi = 2 * along * m - wo
        # Of f cos_i over directions wi = 4 (wo.m) of the measure of normals: F = 1, and (1 - wo.m)^5 in its place.
        weight = dr.select((along > 0) & (wi.z > 0),
                           smith_g1(alpha, mi.Float(cosine)) * smith_g1(alpha, wi.z) * along / (cosine * m.z), 0)
        whole = dr.mean(weight)[0]
        angular = dr.mean(weight * dr.power(dr.clip(1 - along, 0, 1), 5))[0]
        first = f0 + (1 - f0) * angular / whole
        albedo = f0 * whole + (1 - f0) * angular
        entering.append(1 - first + (1 - f0) * (first - albedo))
        lost.append(max(0, 1 - whole))
    return entering, lost


def cosine_mean(values):
    return sum(2 * (i + 0.5) / COSINES * value for i, value in enumerate(values)) / COSINES


class CoatedBeckmann(mi.BSDF):
    """Properties: alpha, metallic, ior, red, green, blue. One-sided: wrap it in "twosided"."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.alpha = props["alpha"]
        metallic, f0 = props["metallic"], ((props["ior"] - 1) / (props["ior"] + 1)) ** 2
        color = mi.Color3f(props["red"], props["green"], props["blue"])
        self.r0 = metallic * color + (1 - metallic) * f0
        entering, lost = integrate_lobe(self.alpha, f0)
        self.base = (1 - metallic) * color / cosine_mean(entering)
        loss, f = cosine_mean(lost), (1 + 20 * color) / 21
        self.rescattered = metallic * f * f * (1 - loss) / ((1 - f * loss) * loss)
        self.entering, self.lost = mi.Float(entering), mi.Float(lost)
        dr.eval(self.entering, self.lost)
        flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        self.m_components = [flags]
        self.m_flags = flags

    def look_up(self, table, cosine, active):
        place = dr.clip(cosine * COSINES - 0.5, 0, COSINES - 1)
        low = dr.minimum(mi.UInt32(place), COSINES - 2)
        share = place - mi.Float(low)
        return (1 - share) * dr.gather(mi.Float, table, low, active) + share * dr.gather(mi.Float, table, low + 1, active)

    def both(self, table, cos_o, cos_i, active):
        return self.look_up(table, cos_o, active) * self.look_up(table, cos_i, active)

    def eval_pdf(self, ctx, si, wo, active):
        cos_o, cos_i = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_o > 0) & (cos_i > 0)
        m = dr.normalize(si.wi + wo)
        along = dr.dot(si.wi, m)
        density = beckmann_density(self.alpha, m.z)
        masking = smith_g1(self.alpha, cos_o) * smith_g1(self.alpha, cos_i)
        facets = schlick(self.r0, along) * density * masking / (4 * cos_o)
        diffuse = (self.base * self.both(self.entering, cos_o, cos_i, active) +
                   self.rescattered * self.both(self.lost, cos_o, cos_i, active)) * (cos_i / dr.pi)
        pdf = 0.5 * density * m.z / (4 * along) + 0.5 * cos_i / dr.pi
        return dr.select(active, facets + diffuse, 0), dr.select(active, pdf, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        facets = sample1 < 0.5
        m = beckmann_normal(self.alpha, sample2)
        wo = dr.select(facets, 2 * dr.dot(si.wi, m) * m - si.wi, mi.warp.square_to_cosine_hemisphere(sample2))
        value, pdf = self.eval_pdf(ctx, si, wo, active & (~facets | (dr.dot(si.wi, m) > 0)))
        bs = mi.BSDFSample3f()
        bs.wo = wo
        bs.pdf = pdf
        bs.eta = 1
        bs.sampled_type = mi.UInt32(+self.m_flags)
        bs.sampled_component = 0
        valid = pdf > 0
        return bs, dr.select(valid, value / dr.select(valid, pdf, 1), 0)

    def eval(self, ctx, si, wo, active):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active):
        return self.eval_pdf(ctx, si, wo, active)[1]


mi.register_bsdf("coated_beckmann", CoatedBeckmann)
