"""The validation page's template."""

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Identification of the rig</title>
<style>
body{font-family:system-ui,sans-serif;margin:1rem auto;padding:0 1rem;max-width:1200px;
line-height:1.4}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,340px),1fr));gap:1rem}
.pair>div{min-width:0}
table{border-collapse:collapse;font-size:.9rem}
td,th{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}
td.l,th.l{text-align:left}
td.w{text-align:left;white-space:normal;min-width:14rem;overflow-wrap:anywhere}
td.n{text-align:left;white-space:normal;min-width:7rem;max-width:14rem;overflow-wrap:anywhere}
.wide{overflow-x:auto;margin-top:.5rem}
section{border-top:2px solid #ccc;margin-top:1.5rem}
h2,h3{overflow-wrap:anywhere}
.good{color:#176b34}.bad{color:#a32020}
</style></head><body>
<script>{{ plotly|safe }}</script>
<h1>Identification of the rig</h1>
<p>{{ fitted }} recording{{ "" if fitted == 1 else "s" }} fitted, {{ estimate.free|length }} free
parameters, {{ estimate.rig.friction }} friction law, BIC {{ "%.0f"|format(estimate.bic) }}.
{% if not estimate.converged %}<strong class="bad">The descent did not end by itself: raise the
limit of iterations before trusting the figures.</strong>{% endif %}</p>
<h2>Recordings</h2>
<p>Errors are root mean squares over a free run from the first sample and over predictions that
restart every 5&nbsp;s, also as share of the measured range. Innovations are what each sample
adds to a prediction from all before it; their size is 1 if the noise explains them.</p>
<div class="wide"><table><tr><th class="l">recording</th><th class="l">role</th><th>channel</th>
<th>free run, rad</th><th>of range</th><th>5 s, rad</th><th>of range</th><th>innovations</th>
<th class="l">residual</th></tr>
{% for r in recordings %}{% set anchor = loop.index0 %}{% for e in r.errors %}<tr>
{% if loop.first %}<td class="n" rowspan="{{ r.errors|length }}"><a
href="#r{{ anchor }}">{{ r.name }}</a></td>
<td class="l" rowspan="{{ r.errors|length }}">{{ r.role }}</td>{% endif %}
<td>{{ e.channel }}</td><td>{{ e.free }}</td><td>{{ e.free_share }}</td><td>{{ e.predicted }}</td>
<td>{{ e.predicted_share }}</td><td>{{ e.size }}</td>
{% if loop.first %}<td class="w {{ 'good' if r.verdict == 'white' else 'bad' }}"
rowspan="{{ r.errors|length }}">{{ r.verdict }}</td>{% endif %}</tr>{% endfor %}{% endfor %}
</table></div>
<h2>Parameters</h2>
<div class="pair"><div class="wide"><table><tr><th class="l">name</th><th>estimate</th>
<th class="l">unit</th><th>95 % interval</th><th>±</th></tr>
{% for p in parameters %}<tr><td class="l">{{ p.name }}</td><td>{{ p.value }}</td>
<td class="l">{{ p.unit }}</td><td>{{ p.between }}</td><td>{{ p.width }}</td></tr>{% endfor %}
</table></div>
<div><h3>What the recordings do not tell</h3>
{% if residual_shape %}<ul>{% for line in residual_shape %}<li>{{ line }}</li>{% endfor %}</ul>
{% else %}<p>No interval is wider than 20 % and no two parameters trade off.</p>{% endif %}
<h3>Noise found</h3>
<div class="wide"><table>{% for n in noise %}<tr><td class="l">{{ n.what }}</td>
{% for v in n['values'] %}<td>{{ v }}</td>{% endfor %}<td class="l">{{ n.unit }}</td></tr>
{% endfor %}</table></div></div></div>
<div class="pair"><div><h3>Correlation of the parameters</h3>{{ correlation|safe }}</div>
{% if friction %}<div><h3>Friction of the lower disc</h3>{{ friction|safe }}</div>{% endif %}</div>
{% if laws %}<section><h2>Friction laws on the same recordings</h2>
<p>{{ comparison.conclusion }}</p>
<div class="wide"><table><tr><th class="l">law</th><th>free</th><th>BIC</th><th>above best</th>
<th>θ<sub>u</sub> free run, rad</th><th>θ<sub>l</sub> free run, rad</th>
<th>θ<sub>u</sub> 5 s, rad</th><th>θ<sub>l</sub> 5 s, rad</th>
<th class="l">stick-free vibration</th>
<th>of the posterior</th></tr>
{% for l in laws %}<tr><td class="l">{{ l.law }}</td><td>{{ l.free }}</td><td>{{ l.bic }}</td>
<td>{{ l.gap }}</td><td>{{ l.theta_u_free }}</td><td>{{ l.theta_l_free }}</td>
<td>{{ l.theta_u_predicted }}</td><td>{{ l.theta_l_predicted }}</td><td class="l">{{ l.can }}</td>
<td>{{ l.soft }}</td></tr>{% endfor %}</table></div>
<p>Errors of the {{ "held-out recordings" if comparison.held_out else "recordings of the fit" }}.
Stick-free vibration: constant voltages up to {{ "%.3g"|format(comparison.to_volts) }} V with a
stable limit cycle whose lower disc never stops; of the posterior: share of its draws in which
steady turning gives way to stable vibration.</p></section>{% endif %}
{% for r in recordings %}<section id="r{{ loop.index0 }}"><h2>{{ r.name }}, {{ r.role }}</h2>
<p>Innovations:
<strong class="{{ 'good' if r.verdict == 'white' else 'bad' }}">{{ r.verdict }}</strong>.
{% if r.estimated %}Measured against noise estimated on this recording with the rig held: torques
{{ r.noise.torque_u }} and {{ r.noise.torque_l }} Nm.{% endif %}</p>
{% for note in r.notes %}<p>{{ note }}</p>{% endfor %}
{{ r.traces|safe }}
{% if r.tests %}<div class="pair"><div><h3>Innovations with themselves</h3>{{ r.auto|safe }}</div>
<div><h3>Innovations with the voltage</h3>{{ r.cross|safe }}</div></div>
<div class="wide"><table><tr><th class="l">channel</th><th>outside the 95 % band</th>
<th>p, Ljung-Box</th><th>peak over white</th><th>p, peak</th><th>voltage: outside</th>
<th>largest</th><th>p, voltage</th></tr>
{% for t in r.tests %}<tr><td class="l">{{ t.channel }}</td><td>{{ t.outside }}</td>
<td>{{ t.p_white }}</td><td>{{ t.peak }}</td><td>{{ t.p_peak }}</td><td>{{ t.cross_outside }}</td>
<td>{{ t.cross_largest }}</td><td>{{ t.p_cross }}</td></tr>{% endfor %}</table></div>{% endif %}
</section>{% endfor %}
<script>
// A plot made while its row was still alone has taken the whole width.
addEventListener('load', () => dispatchEvent(new Event('resize')));
</script>
</body></html>
"""
