// Traces rays of a buffer: one invocation a ray. The includer declares `push` and names its tracer.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Rays {
  Ray at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Hits {
  Hit at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Answers {
  uint at[];
};

void trace_ray(uint index) {
  if (index >= push.count) return;
  const Ray ray = Rays(push.rays).at[index];
  if (push.hits != 0) Hits(push.hits).at[index] = intersect(ray);
  if (push.occluded != 0) Answers(push.occluded).at[index] = occluded(ray) ? 1 : 0;
}
