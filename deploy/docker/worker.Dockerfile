# A farm worker: Python, Mesa's EGL and glvnd, no root. On NVIDIA hosts the container runtime adds the driver.
FROM python:3.11-slim AS packages
# meshoptimizer comes as source only and is compiled.
RUN apt-get update && apt-get install -y --no-install-recommends g++
RUN pip install --no-cache-dir uv==0.13.9
WORKDIR /build
COPY requirements.lock ./
COPY services/ services/
COPY shading/ shading/
COPY worker/ worker/
# The lock constrains versions and hashes; only what these packages need is installed.
RUN uv venv /opt/farfield && VIRTUAL_ENV=/opt/farfield uv pip install --no-cache \
    --constraint requirements.lock --build-constraint requirements.lock \
    ./services/core ./services/api ./services/cli ./shading ./worker

FROM python:3.11-slim
RUN apt-get update && apt-get install -y --no-install-recommends libegl1 libgl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*
# Tells glvnd of NVIDIA's EGL, whose library the container runtime mounts.
COPY deploy/docker/10_nvidia.json /usr/share/glvnd/egl_vendor.d/10_nvidia.json
RUN useradd --uid 10001 --create-home farfield \
    && install -d -o farfield -g farfield /store /var/cache/farfield
COPY --from=packages /opt/farfield /opt/farfield
ENV PATH=/opt/farfield/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    FARFIELD_STORE=/store \
    NVIDIA_DRIVER_CAPABILITIES=compute,graphics,utility
USER farfield
WORKDIR /home/farfield
VOLUME /store
HEALTHCHECK --interval=30s --timeout=15s --start-period=30s CMD ["farfield", "worker", "--ping"]
CMD ["farfield", "worker"]
