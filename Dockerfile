# docker build -t tribrach . && docker run --rm -v "$PWD:/job" tribrach run project.toml
FROM python:3.13-slim
COPY . /source
RUN pip install --no-cache-dir /source && rm -r /source
WORKDIR /job
ENTRYPOINT ["tribrach"]
CMD ["--help"]
