# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # The data of a report
# Beside every page of a report stands `data.tar.xz`, all that it is made of: errors as CSV, times as JSON of Google Benchmark
# ([formats](../data-formats.md)). DuckDB reads both, whole folders at once.

# %%
import shutil
import tempfile
from pathlib import Path

import duckdb
import matplotlib.pyplot as plt

folder = Path(tempfile.mkdtemp())
shutil.unpack_archive("reports/example/data.tar.xz", folder)
data = folder / "data"
duckdb.sql(f"CREATE TABLE errors AS SELECT * FROM read_csv('{data}/errors-*.csv', all_varchar=true)")
duckdb.sql("""
    SELECT count(*) AS answers, count(DISTINCT scene) AS scenes, count(DISTINCT variant) AS variants
    FROM errors
""").show()

# %% [markdown]
# ## Errors
# A row is one measure of one answer. The median relative error of accelerations, and the share that was refused, on a stretched-out chain of 127 links:

# %%
chain = duckdb.sql("""
    SELECT variant,
           median(value::DOUBLE) FILTER (outcome = 'ok') AS error,
           avg((outcome <> 'ok')::INTEGER) AS refused
    FROM errors
    WHERE scene = 'straight:127' AND task = 'acceleration' AND measure = 'relative' AND precision = 'float32'
    GROUP BY variant ORDER BY refused, error
""")
chain.show()
refused = {variant for variant, _, share in chain.fetchall() if share == 1}
assert {"Batch<EigenLLT>", "Batch<OpenBLAS>"} <= refused

# %% [markdown]
# ## Times
# The files of Google Benchmark hold an array of benchmarks, of which the medians of repetitions are wanted.

# %%
duckdb.sql(f"""
    CREATE TABLE times AS
    SELECT split_part(run_name, '/', 1) AS task, split_part(run_name, '/', 2) AS variant,
           split_part(run_name, '/', 3) AS scene, split_part(run_name, '/', 4) AS precision, cpu_time / 1000 AS us
    FROM (SELECT unnest(benchmarks, recursive := true)
          FROM read_json('{data}/times-*.json', columns = {{benchmarks:
               'STRUCT(run_name VARCHAR, aggregate_name VARCHAR, cpu_time DOUBLE)[]'}}))
    WHERE aggregate_name = 'median'
""")
duckdb.sql("""
    SELECT scene, variant, round(us, 2) AS us FROM times
    WHERE task = 'acceleration' AND precision = 'float64' AND variant IN ('Ladder<default>', 'MuJoCo')
    ORDER BY scene, us
""").show()

# %% [markdown]
# ## Error against time
# Both together, of the humanoid g1: what is below and left of all others is worth choosing.

# %%
points = duckdb.sql("""
    SELECT variant, t.us, median(e.value::DOUBLE) AS error
    FROM times t JOIN errors e USING (variant, scene, precision, task)
    WHERE scene = 'g1:35' AND precision = 'float64' AND task = 'acceleration'
      AND e.measure = 'relative' AND e.outcome = 'ok'
    GROUP BY ALL ORDER BY t.us
""").fetchall()
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for variant, us, error in points:
    axes.loglog(us, error, "o")
    axes.annotate(variant, (us, error), fontsize=6)
axes.set(xlabel="time of a [µs]", ylabel="median relative error of a")
plt.show()
assert min(points, key=lambda point: point[1])[0].startswith("Ladder")
