# The API and the pages: no GL, no compiler, no root.
FROM node:20-slim AS web
WORKDIR /build/web
COPY web/ ./
COPY shading/ ../shading/
RUN npm ci --no-audit --no-fund && npm run build

FROM python:3.11-slim AS packages
RUN pip install --no-cache-dir uv==0.13.9
WORKDIR /build
COPY requirements.lock ./
COPY shading/ shading/
COPY services/core/ services/core/
COPY services/api/ services/api/
# The lock constrains versions and hashes; only what these packages need is installed.
RUN uv venv /opt/farfield && VIRTUAL_ENV=/opt/farfield uv pip install --no-cache \
    --constraint requirements.lock --build-constraint requirements.lock \
    ./shading ./services/core ./services/api

FROM python:3.11-slim
RUN useradd --uid 10001 --create-home farfield && install -d -o farfield -g farfield /store
COPY --from=packages /opt/farfield /opt/farfield
COPY --from=web /build/web/app/dist /usr/share/farfield/web
ENV PATH=/opt/farfield/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    FARFIELD_HOST=0.0.0.0 \
    FARFIELD_STORE=/store \
    FARFIELD_WEB=/usr/share/farfield/web
USER farfield
WORKDIR /home/farfield
VOLUME /store
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s CMD ["python", "-c", \
    "import urllib.request as u; u.urlopen('http://127.0.0.1:8000/api/v1/health', timeout=2)"]
CMD ["python", "-m", "farfield_api.server"]
