{% for statement in statements %}
({{ statement|comment|upper }})
{% endfor %}
{% for statement in verified %}
({{ statement|comment|upper }})
{% endfor %}
